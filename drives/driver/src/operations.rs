//! The operations of a drive: the one list, from which both shells are made.
//!
//! A row has the documentation of a method, its name, arguments and result, and the sequence that it runs. A shell
//! hands in a macro that makes methods of rows; so an operation that one shell has, the other one has too.

/// Makes methods of all operations by the macro of a shell.
macro_rules! operations {
    ($shell:ident) => {
        $shell! {
            /// The state of the state machine.
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn state(desk) -> State = sequence::state(desk);

            /// Why the drive is in fault: the last emergency, or else the latest entry of 1003h.
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn cause(desk) -> Cause = sequence::cause(desk);

            /// Leads the drive to OPERATION ENABLED, by way of NMT OPERATIONAL when it takes orders by PDO.
            ///
            /// # Errors
            ///
            /// [`Error::Refused`] without supply, say; [`Error::Fault`] in FAULT; [`Error::NoReaction`].
            fn enable(desk) -> () = sequence::enable(desk);

            /// Stops the drive with its programmed deceleration, then releases the motor.
            ///
            /// # Errors
            ///
            /// [`Error::NoReaction`], [`Error::Fault`].
            fn disable(desk) -> () = sequence::disable(desk);

            /// Brakes with full deceleration and forgets the travel; the motor keeps its torque.
            ///
            /// # Errors
            ///
            /// [`Error::Refused`] outside OPERATION ENABLED, where nothing is to be stopped; [`Error::NoReaction`];
            /// [`Error::NotStopped`].
            fn quick_stop(desk) -> () = sequence::quick_stop(desk);

            /// Resets a fault and says what it was; `None` when there was none.
            ///
            /// # Errors
            ///
            /// [`Error::Fault`] when its cause is still there.
            fn reset_fault(desk) -> Option<Cause> = sequence::reset_fault(desk);

            /// The operating mode; `None` for one that the driver does not know.
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn mode(desk) -> Option<Mode> = sequence::mode(desk);

            /// Changes the operating mode, unless it is set already.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Refused`] while a travel is under way; [`Error::ModeNotTaken`].
            fn set_mode(desk, mode: Mode) -> () = sequence::set_mode(desk, mode);

            /// Travels to `target`, in units of positions, and waits for the end.
            ///
            /// # Errors
            ///
            /// [`Error::Refused`] with every condition that is not met, before anything moves.
            fn move_to(desk, target: i32) -> Outcome = sequence::travel(desk, target, desk.patience(), &mut |_| {});

            /// The same, and calls `watch` with every status word that comes.
            ///
            /// # Errors
            ///
            /// As [`Drive::move_to`].
            fn move_to_watched(desk, target: i32, watch: impl FnMut(Progress) + Send) -> Outcome =
                sequence::travel(desk, target, desk.patience(), &mut { watch });

            /// Starts to travel to `target`; returns once the drive has taken the order.
            ///
            /// # Errors
            ///
            /// As [`Drive::move_to`].
            fn start_moving_to(desk, target: i32) -> () = sequence::start_travel(desk, target);

            /// Waits until the travel under way is over.
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn finish(desk) -> Outcome = sequence::finish(desk, desk.patience(), &mut |_| {});

            /// The same, and reports how far the travel has come whenever the drive does.
            ///
            /// # Errors
            ///
            /// As [`Drive::finish`].
            fn finish_watched(desk, watch: impl FnMut(Progress) + Send) -> Outcome =
                sequence::finish(desk, desk.patience(), &mut { watch });

            /// Interrupts the travel under way; returns once the drive stands.
            ///
            /// # Errors
            ///
            /// [`Error::Refused`] when no travel is under way.
            fn interrupt(desk) -> () = sequence::interrupt(desk);

            /// Goes on with an interrupted travel, also after torque deactivation.
            ///
            /// # Errors
            ///
            /// [`Error::Refused`] when no travel is under way; [`Error::NotTaken`] when the drive does not move on.
            fn resume(desk) -> () = sequence::resume(desk);

            /// Inching: travels once by the width that the drive is set to, and waits for the end.
            ///
            /// No bit takes a step back. What stops the drive before its end, does so by quick stop.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Refused`] before anything moves; [`Error::NotTaken`].
            fn step(desk) -> Outcome = sequence::step(desk, desk.patience());

            /// Inching: moves until [`Drive::stop_inching`], or until a limit is passed.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Refused`] before anything moves; [`Error::NotTaken`].
            fn inch(desk, direction: Direction) -> () = sequence::inch(desk, direction);

            /// Ends inching, and says where the drive stands. A step leaves it in QUICK STOP ACTIVE.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; when the drive cannot be read.
            fn stop_inching(desk) -> i32 = sequence::stop_inching(desk);

            /// Runs at `velocity`, as 60FFh has it, whose sign is the direction; waits until it is reached.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Refused`] before anything moves.
            fn run_at(desk, velocity: i32) -> VelocityOutcome = sequence::run_at(desk, velocity, desk.patience());

            /// Stops all that moves with its programmed deceleration; returns once the drive stands. A travel is
            /// interrupted: [`Drive::resume`] goes on with it, and [`Drive::disable`] forgets it. A step is stopped
            /// quickly, and leaves the drive in QUICK STOP ACTIVE.
            ///
            /// # Errors
            ///
            /// [`Error::NotStopped`]; when the drive cannot be read.
            fn stop(desk) -> () = sequence::stop(desk);

            /// Where the drive is (6064h).
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn position(desk) -> i32 = desk.position();

            /// How fast it is (606Ch).
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn velocity(desk) -> i32 = desk.velocity();

            /// Makes `position` the actual position.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Refused`] while a travel is under way; [`Error::OutOfRange`];
            /// [`Error::Sdo`] when it is outside the limits of travel; [`Error::NotCalibrated`].
            fn calibrate(desk, position: i32) -> () = sequence::calibrate(desk, position);

            /// From which side targets are approached; `None` for a value that the manual does not have.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; when the drive cannot be read.
            fn approach(desk) -> Option<Approach> = sequence::approach(desk);

            /// Chooses from which side targets are approached (loop positioning).
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Sdo`].
            fn set_approach(desk, approach: Approach) -> () = sequence::set_approach(desk, approach);

            /// Reads all parameters of the manual's table.
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn read_parameters(desk) -> Vec<Setting> = sequence::read_parameters(desk);

            /// Which of the settings the drive does not have.
            ///
            /// # Errors
            ///
            /// [`Error::NoParameter`] before anything is sent; when the drive cannot be read.
            fn compare_parameters(desk, settings: &[Setting]) -> Vec<Difference> =
                sequence::compare_parameters(desk, settings);

            /// Writes those settings that differ.
            ///
            /// # Errors
            ///
            /// [`Error::NoParameter`] or [`Error::OutOfRange`] before anything is sent; [`Error::Refused`] while a
            /// travel is under way; [`Error::Sdo`] with the first one that the drive refuses, in any order they are written
            /// after.
            fn write_parameters(desk, settings: &[Setting]) -> () = sequence::write_parameters(desk, settings);

            /// Keeps all parameters for when there is no power (1010h).
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`] also by a drive that keeps them anyway; [`Error::Refused`] while a travel is
            /// under way.
            fn store(desk) -> () = sequence::store(desk);

            /// Restores a set of parameters to factory settings (1011h); all of them for `None`.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Refused`] while a travel is under way.
            fn restore(desk, set: Option<ParameterSet>) -> () = sequence::restore(desk, set);

            /// What one count of a position is worth, as the drive is set up.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; when the drive cannot be read.
            fn units(desk) -> Units = sequence::units(desk);

            /// The temperature of the drive, in °C.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; when the drive cannot be read.
            fn temperature(desk) -> f64 = sequence::temperature(desk);

            /// The voltage of the drive's battery, in V.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; when the drive cannot be read.
            fn battery_voltage(desk) -> f64 = sequence::battery_voltage(desk);

            /// Whether its load has stopped the drive (torque deactivation).
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; when the drive cannot be read.
            fn torque_deactivated(desk) -> bool = sequence::torque_deactivated(desk);

            /// The load in % that stops a travel; `None` when none does.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; when the drive cannot be read.
            fn torque_threshold(desk) -> Option<u8> = sequence::torque_threshold(desk);

            /// Sets the load in % that stops a travel; with `None`, none does.
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`], [`Error::OutOfRange`]; [`Error::Sdo`].
            fn set_torque_threshold(desk, percent: Option<u8>) -> () =
                sequence::set_torque_threshold(desk, percent);

            /// The version of the drive's firmware (100Ah): four characters, such as "1.00".
            ///
            /// # Errors
            ///
            /// When the drive cannot be read.
            fn firmware(desk) -> String = sequence::firmware(desk);

            /// Switches emergency messages on or off (1014h).
            ///
            /// # Errors
            ///
            /// [`Error::Unsupported`]; [`Error::Sdo`] by a drive that allows it in NMT PRE-OPERATIONAL only.
            fn set_emergencies(desk, on: bool) -> () = sequence::set_emergencies(desk, on);

            /// Reads an object.
            ///
            /// # Errors
            ///
            /// [`Error::Sdo`], [`Error::DataSheet`].
            fn read [T: Value, A: Readable, M] (desk, object: Object<T, A, M>) -> T = desk.read(object);

            /// Writes an object.
            ///
            /// # Errors
            ///
            /// [`Error::OutOfRange`] before anything is sent; [`Error::Sdo`].
            fn write [T: Value, A: Writable, M] (desk, object: Object<T, A, M>, value: T) -> () =
                desk.write(object, value);

            /// Lets time pass, and keeps listening meanwhile. While the drive may be moving, its status word is looked
            /// at, and read if the drive sends none.
            ///
            /// # Errors
            ///
            /// [`Error::Link`], [`Error::Restarted`]; while the drive may be moving, also [`Error::Fault`], and
            /// [`Error::Sdo`] if it does not answer any more.
            fn pass(desk, span: Duration) -> () = sequence::pass(desk, span);
        }
    };
}

pub(crate) use operations;
