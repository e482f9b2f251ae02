//! The operations of a drive: the one list, from which both shells are made.
//!
//! A row has the documentation of a method, its name, arguments and result, and the sequence that it runs. A shell
//! hands in a macro that makes methods of rows; so an operation that one shell has, the other one has too.

/// Makes methods of all operations by the macro of a shell.
macro_rules! operations {
    ($shell:ident) => {
        $shell! {
            /// The state of the state machine.
            fn state(drive) -> State = sequence::state(drive);

            /// Why the drive is in fault: the last emergency, or else the latest entry of 1003h.
            fn cause(drive) -> Cause = sequence::cause(drive);

            /// Leads the drive to OPERATION ENABLED, by way of NMT OPERATIONAL when it takes orders by PDO.
            ///
            /// Errors: [`Error::Refused`] without supply, say; [`Error::Fault`] in FAULT.
            fn enable(drive) -> () = sequence::enable(drive);

            /// Stops the drive with its programmed deceleration, then releases the motor.
            ///
            /// Errors: [`Error::NoReaction`], [`Error::Fault`].
            fn disable(drive) -> () = sequence::disable(drive);

            /// Brakes with full deceleration and forgets the travel; the motor keeps its torque.
            ///
            /// Errors: [`Error::Refused`] outside OPERATION ENABLED, where nothing is to be stopped; [`Error::NotStopped`].
            fn quick_stop(drive) -> () = sequence::quick_stop(drive);

            /// What the drive has reported since its history was cleared, the latest first (1003h).
            fn fault_history(drive) -> Vec<Cause> = sequence::fault_history(drive);

            /// Clears the history (1003h).
            fn clear_fault_history(drive) -> () = sequence::clear_fault_history(drive);

            /// What the drive warns of, which is no fault; `None` while it does not. [`Cause::NoError`] if it does not say
            /// of what.
            fn warning(drive) -> Option<Cause> = sequence::warning(drive);

            /// Resets a fault and says what it was; `None` when there was none.
            ///
            /// Errors: [`Error::Fault`] when its cause is still there.
            fn reset_fault(drive) -> Option<Cause> = sequence::reset_fault(drive);

            /// The operating mode; `None` for one that the driver does not know.
            fn mode(drive) -> Option<Mode> = sequence::mode(drive);

            /// Changes the operating mode, unless it is set already.
            ///
            /// Errors: [`Error::Refused`] while a travel is under way.
            fn set_mode(drive, mode: Mode) -> () = sequence::set_mode(drive, mode);

            /// Travels to `target`, in units of positions, and waits for the end.
            ///
            /// Errors: [`Error::Refused`] with every condition that is not met.
            fn move_to(drive, target: i32) -> Outcome = sequence::travel(drive, target, drive.patience(), &mut |_| {});

            /// The same, and calls `watch` with every status word that comes.
            fn move_to_watched(drive, target: i32, watch: impl FnMut(Progress) + Send) -> Outcome =
                sequence::travel(drive, target, drive.patience(), &mut { watch });

            /// Starts to travel to `target`; returns once the drive has taken the order.
            fn start_moving_to(drive, target: i32) -> () = sequence::start_travel(drive, target);

            /// Has the drive hold each target until SYNC, or not any more, so that several drives start together. The
            /// drive stays so at least until it restarts: a program that ends takes it back.
            ///
            /// Errors: [`Error::Unsupported`] by a drive that does not take a target and its start in one PDO;
            /// [`Error::Refused`] while the drive is enabled; [`Error::Sdo`] when the drive does not allow it.
            fn set_start_by_sync(drive, on: bool) -> () = sequence::set_start_by_sync(drive, on);

            /// Hands the drive a target for which it starts with the next SYNC, which the program sends;
            /// [`Drive::confirm_start`] comes after that. Any other order takes the target back.
            ///
            /// Errors: [`Error::Refused`] also when the drive would start at once.
            fn prepare_moving_to(drive, target: i32) -> () = sequence::prepare_travel(drive, target);

            /// Waits until the drive has taken the target that it was prepared for.
            ///
            /// Errors: [`Error::NotTaken`] when no SYNC has come: the target is then taken back.
            fn confirm_start(drive) -> () = sequence::confirm_start(drive);

            /// Gives the drive another set-point, also while it travels; returns once the drive has taken it. If it has no
            /// room for one more, waits until it has. [`Drive::finish`] waits for the last one.
            ///
            /// Errors: [`Error::Refused`], also while a travel is interrupted.
            fn add_set_point(drive, set_point: SetPoint) -> () =
                sequence::add_set_point(drive, set_point, drive.patience());

            /// Waits until the travel under way is over.
            fn finish(drive) -> Outcome = sequence::finish(drive, drive.patience(), &mut |_| {});

            /// The same, and reports how far the travel has come whenever the drive does.
            fn finish_watched(drive, watch: impl FnMut(Progress) + Send) -> Outcome =
                sequence::finish(drive, drive.patience(), &mut { watch });

            /// Interrupts the travel under way; returns once the drive stands.
            ///
            /// Errors: [`Error::Refused`] when no travel is under way.
            fn interrupt(drive) -> () = sequence::interrupt(drive);

            /// Goes on with an interrupted travel, also after torque deactivation.
            ///
            /// Errors: [`Error::Refused`] when no travel is under way; [`Error::NotTaken`] when the drive does not move
            /// on.
            fn resume(drive) -> () = sequence::resume(drive);

            /// Drops the rest of the travel under way, interrupted or not: the drive is stopped and disabled.
            ///
            /// Errors: [`Error::Refused`] when no travel is under way.
            fn drop_travel(drive) -> () = sequence::drop_travel(drive);

            /// Inching: travels once by the width that the drive is set to, and waits for the end.
            ///
            /// No bit takes a step back. What stops the drive before its end, does so by quick stop.
            fn step(drive) -> Outcome = sequence::step(drive, drive.patience());

            /// Inching: moves until [`Drive::stop_inching`], or until a limit is passed.
            fn inch(drive, direction: Direction) -> () = sequence::inch(drive, direction);

            /// Ends inching, and says where the drive stands. A step leaves it in QUICK STOP ACTIVE.
            fn stop_inching(drive) -> i32 = sequence::stop_inching(drive);

            /// Runs at `velocity`, as 60FFh has it, whose sign is the direction; waits until it is reached.
            fn run_at(drive, velocity: i32) -> VelocityOutcome = sequence::run_at(drive, velocity, drive.patience());

            /// Turns with `torque`, in 1/1000 of the rated torque; returns once the drive has taken the order. How fast it
            /// turns then, its load decides.
            fn apply_torque(drive, torque: i16) -> () = sequence::apply_torque(drive, torque);

            /// The torque that it turns with (6077h), in 1/1000 of the rated torque.
            fn torque(drive) -> i16 = sequence::torque(drive);

            /// Sets the drive up for a [cyclic](crate::cyclic) mode: PDOs, period, mode, and a set-point where it stands. It
            /// is disabled, and nothing moves.
            ///
            /// Errors: [`Error::Sdo`] by a drive whose mapping is fixed.
            fn prepare_cyclic(drive, settings: AxisSettings) -> Axis = sequence::prepare_cyclic(drive, settings);

            /// Stops all that moves with its programmed deceleration; returns once the drive stands. A travel is
            /// interrupted: [`Drive::resume`] goes on with it, and [`Drive::disable`] forgets it. A step is stopped
            /// quickly, and leaves the drive in QUICK STOP ACTIVE.
            ///
            /// Errors: [`Error::NotStopped`], and those of an access.
            fn stop(drive) -> () = sequence::stop(drive);

            /// Where the drive is (6064h).
            fn position(drive) -> i32 = drive.position();

            /// The lowest and the highest position (607Dh); `None` if none limits the drive.
            fn limits(drive) -> Option<(i32, i32)> = sequence::limits(drive);

            /// How fast it is (606Ch).
            fn velocity(drive) -> i32 = drive.velocity();

            /// Homes by a method of 6098h, such as to a switch or an index pulse, and waits for the end. The drive comes back
            /// to the mode that it was in, unless it is still under way.
            ///
            /// Errors: [`Error::Unsupported`], also of a method that the drive does not have; [`Error::Refused`] before
            /// anything moves.
            fn home(drive, method: i8) -> HomingOutcome = sequence::home(drive, method, drive.patience());

            /// Makes `position` the actual position.
            ///
            /// Errors: [`Error::Refused`] while a travel is under way; [`Error::Sdo`] when it is outside the limits of
            /// travel.
            fn calibrate(drive, position: i32) -> () = sequence::calibrate(drive, position);

            /// Arms a latch: the next edge keeps the position. What it kept before is gone.
            ///
            /// Errors: [`Error::NotTaken`] when the drive does not forget what was before.
            fn arm_latch(drive, trigger: Trigger) -> () = sequence::arm_latch(drive, trigger);

            /// The position that a latch has kept since it was armed; `None` if no edge has come.
            fn latched(drive, trigger: Trigger) -> Option<i32> = sequence::latched(drive, trigger);

            /// Disarms a latch.
            fn disarm_latch(drive, trigger: Trigger) -> () = sequence::disarm_latch(drive, trigger);

            /// What the drive does in a situation: the option code of 605Ah to 605Eh.
            fn reaction(drive, to: Reaction) -> i16 = sequence::reaction(drive, to);

            /// Sets what the drive does in a situation.
            ///
            /// Errors: [`Error::Refused`] while a travel is under way.
            fn set_reaction(drive, to: Reaction, code: i16) -> () = sequence::set_reaction(drive, to, code);

            /// From which side targets are approached; `None` for a value that the manual does not have.
            fn approach(drive) -> Option<Approach> = sequence::approach(drive);

            /// Chooses from which side targets are approached (loop positioning).
            fn set_approach(drive, approach: Approach) -> () = sequence::set_approach(drive, approach);

            /// Reads all parameters of the manual's table.
            fn read_parameters(drive) -> Vec<Setting> = sequence::read_parameters(drive);

            /// Which of the settings the drive does not have.
            fn compare_parameters(drive, settings: &[Setting]) -> Vec<Difference> =
                sequence::compare_parameters(drive, settings);

            /// Writes those settings that differ.
            ///
            /// Errors: [`Error::NoParameter`] or [`Error::OutOfRange`] before anything is sent; [`Error::Refused`]
            /// while a travel is under way; [`Error::Sdo`] with the first one that the drive refuses, in any order they
            /// are written after.
            fn write_parameters(drive, settings: &[Setting]) -> () = sequence::write_parameters(drive, settings);

            /// Keeps all parameters for when there is no power (1010h).
            ///
            /// Errors: [`Error::Unsupported`] also by a drive that keeps them anyway; [`Error::Refused`] while a travel
            /// is under way.
            fn store(drive) -> () = sequence::store(drive);

            /// Restores a set of parameters to factory settings (1011h); all of them for `None`.
            ///
            /// Errors: [`Error::Refused`] while a travel is under way.
            fn restore(drive, set: Option<ParameterSet>) -> () = sequence::restore(drive, set);

            /// What one count of a position is worth, as the drive is set up.
            fn units(drive) -> Units = sequence::units(drive);

            /// The temperature of the drive, in °C.
            fn temperature(drive) -> f64 = sequence::temperature(drive);

            /// The voltage of the drive's battery, in V.
            fn battery_voltage(drive) -> f64 = sequence::battery_voltage(drive);

            /// Whether its load has stopped the drive (torque deactivation).
            fn torque_deactivated(drive) -> bool = sequence::torque_deactivated(drive);

            /// The load in % that stops a travel; `None` when none does.
            fn torque_threshold(drive) -> Option<u8> = sequence::torque_threshold(drive);

            /// Sets the load in % that stops a travel; with `None`, none does.
            fn set_torque_threshold(drive, percent: Option<u8>) -> () =
                sequence::set_torque_threshold(drive, percent);

            /// The version of the drive's firmware (100Ah): four characters, such as "1.00".
            fn firmware(drive) -> String = sequence::firmware(drive);

            /// Switches emergency messages on or off (1014h).
            ///
            /// Errors: [`Error::Sdo`] by a drive that allows it in NMT PRE-OPERATIONAL only.
            fn set_emergencies(drive, on: bool) -> () = sequence::set_emergencies(drive, on);

            /// Configures PDOs that are the application's: each is switched off, mapped, and switched on in NMT
            /// PRE-OPERATIONAL; the node is in OPERATIONAL afterwards.
            ///
            /// Errors: [`Error::PdoInUse`] for a PDO by which the driver itself talks to the drive; [`Error::Refused`]
            /// while the drive is enabled; [`Error::Sdo`] when the drive does not allow it.
            fn configure_pdos(drive, pdos: &[PdoSettings<'_>]) -> () = sequence::configure_pdos(drive, pdos);

            /// Which transmit PDOs (1 to 4) may fill the bus while the drive moves: those that are sent whenever they
            /// change, without an inhibit time. Many drives come so from the factory, and two of them leave no room for
            /// the SDOs of any node at 500 kbit/s.
            fn unpaced_pdos(drive) -> Vec<UnpacedPdo> = sequence::unpaced_pdos(drive);

            /// Sends receive PDO `number` (1 to 4), which the application has mapped.
            ///
            /// Errors: [`Error::PdoInUse`] for one by which the driver itself talks to the drive.
            fn send_pdo [V: Values, N](drive, number: u16, mapping: &Mapping<Rpdo, V, N>, values: V) -> () =
                sequence::send_pdo(drive, number, mapping, values);

            /// The values of transmit PDO `number` (1 to 4), which the application has mapped: of the last one that has
            /// come, or the next one if none has since it was asked for before.
            ///
            /// Errors: [`Error::NoPdo`], [`Error::ShortPdo`].
            fn receive_pdo [V: Values, N](drive, number: u16, mapping: &Mapping<Tpdo, V, N>) -> V =
                sequence::receive_pdo(drive, number, mapping);

            /// Reads an object.
            fn read [T: Value, A: Readable, M, D] (drive, object: Object<T, A, M, D>) -> T = drive.read(object);

            /// Writes an object.
            fn write [T: Value, A: Writable, M, D] (drive, object: Object<T, A, M, D>, value: T) -> () =
                drive.write(object, value);

            /// Lets time pass, and keeps listening meanwhile. While the drive may be moving, its status word is looked
            /// at, and read if the drive sends none.
            ///
            /// Errors: [`Error::Link`], [`Error::Restarted`]; while the drive may be moving, also [`Error::Fault`], and
            /// [`Error::Sdo`] if it does not answer any more.
            fn pass(drive, span: Duration) -> () = sequence::pass(drive, span);
        }
    };
}

pub(crate) use operations;
