//! The operations of a drive: the one list, of which both shells are made.
//!
//! A row has a method's documentation, name, arguments and result, and the sequence that it runs. A shell hands in a
//! macro that makes methods of the rows, so all shells have the same operations.

/// Makes methods of all operations, by the macro of a shell.
macro_rules! operations {
    ($shell:ident) => {
        $shell! {
            /// The state of the state machine.
            fn state(drive) -> State = sequence::state(drive);

            /// Why the drive is in fault: the last emergency message, or else the latest entry of 1003h.
            fn cause(drive) -> Cause = sequence::cause(drive);

            /// Leads the drive to OPERATION ENABLED, through NMT OPERATIONAL if it takes orders by PDO.
            ///
            /// Errors: [`Error::Refused`], such as without supply; [`Error::Fault`] in FAULT.
            fn enable(drive) -> () = sequence::enable(drive);

            /// Stops the drive with its programmed deceleration, then releases the motor.
            ///
            /// Errors: [`Error::NoReaction`], [`Error::Fault`].
            fn disable(drive) -> () = sequence::disable(drive);

            /// Brakes with full deceleration and drops the travel; the motor keeps its torque.
            ///
            /// Errors: [`Error::Refused`] outside OPERATION ENABLED, where nothing moves; [`Error::NotStopped`].
            fn quick_stop(drive) -> () = sequence::quick_stop(drive);

            /// The faults since the history was cleared, the latest first (1003h).
            fn fault_history(drive) -> Vec<Cause> = sequence::fault_history(drive);

            /// Clears the history (1003h).
            fn clear_fault_history(drive) -> () = sequence::clear_fault_history(drive);

            /// The present warning, which is not a fault, or `None`. [`Cause::NoError`] if the drive does not say what
            /// it warns of.
            fn warning(drive) -> Option<Cause> = sequence::warning(drive);

            /// Resets a fault and says what it was; `None` if there was none.
            ///
            /// Errors: [`Error::Fault`] when its cause is still there.
            fn reset_fault(drive) -> Option<Cause> = sequence::reset_fault(drive);

            /// The operating mode; `None` for one that the driver does not know.
            fn mode(drive) -> Option<Mode> = sequence::mode(drive);

            /// Changes the operating mode, unless it is set already.
            ///
            /// Errors: [`Error::Refused`] while a travel is under way.
            fn set_mode(drive, mode: Mode) -> () = sequence::set_mode(drive, mode);

            /// Travels to `target`, in the drive's units of position, and waits for the end.
            ///
            /// Errors: [`Error::Refused`] with every condition that is not met.
            fn move_to(drive, target: i32) -> Outcome = sequence::travel(drive, target, drive.patience(), &mut |_| {});

            /// As [`Drive::move_to`], and calls `watch` with every status word that comes.
            fn move_to_watched(drive, target: i32, watch: impl FnMut(Progress) + Send) -> Outcome =
                sequence::travel(drive, target, drive.patience(), &mut { watch });

            /// Starts a travel to `target`; returns once the drive has taken the order.
            fn start_moving_to(drive, target: i32) -> () = sequence::start_travel(drive, target);

            /// Switches on or off that the drive holds each target until SYNC, so that several drives start together.
            /// The drive stays so at least until it restarts: a program switches it off before it ends.
            ///
            /// Errors: [`Error::Unsupported`] if the drive does not take a target and its start in one PDO;
            /// [`Error::Refused`] while the drive is enabled; [`Error::Sdo`] if the drive does not allow it.
            fn set_start_by_sync(drive, on: bool) -> () = sequence::set_start_by_sync(drive, on);

            /// Hands the drive a target for which it starts at the next SYNC. The program sends that SYNC, and then
            /// calls [`Drive::confirm_start`]. Any other order takes the target back.
            ///
            /// Errors: [`Error::Refused`], also if the drive would start at once.
            fn prepare_moving_to(drive, target: i32) -> () = sequence::prepare_travel(drive, target);

            /// Waits until the drive has taken the prepared target.
            ///
            /// Errors: [`Error::NotTaken`] if no SYNC has come; the target is then taken back.
            fn confirm_start(drive) -> () = sequence::confirm_start(drive);

            /// Gives the drive another set-point, also while it travels; returns once the drive has taken it, and waits
            /// for room if the drive has none. [`Drive::finish`] waits for the last one.
            ///
            /// Errors: [`Error::Refused`], also while a travel is interrupted.
            fn add_set_point(drive, set_point: SetPoint) -> () =
                sequence::add_set_point(drive, set_point, drive.patience());

            /// Waits until the travel under way is over.
            fn finish(drive) -> Outcome = sequence::finish(drive, drive.patience(), &mut |_| {});

            /// As [`Drive::finish`], and calls `watch` whenever the drive reports its progress.
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

            /// Inching: travels one step of the set width, and waits for the end.
            ///
            /// A step cannot be taken back by a control bit, so only a quick stop ends it early.
            fn step(drive) -> Outcome = sequence::step(drive, drive.patience());

            /// Inching: moves until [`Drive::stop_inching`], or until it passes a limit.
            fn inch(drive, direction: Direction) -> () = sequence::inch(drive, direction);

            /// Ends inching, and returns the position of the drive. After a step it is in QUICK STOP ACTIVE.
            fn stop_inching(drive) -> i32 = sequence::stop_inching(drive);

            /// Runs at `velocity`, in the unit of 60FFh and with its sign as the direction; waits until it is reached.
            fn run_at(drive, velocity: i32) -> VelocityOutcome = sequence::run_at(drive, velocity, drive.patience());

            /// Turns with `torque`, in 1/1000 of the rated torque; returns once the drive has taken the order. The load
            /// decides how fast it turns.
            fn apply_torque(drive, torque: i16) -> () = sequence::apply_torque(drive, torque);

            /// The actual torque (6077h), in 1/1000 of the rated torque.
            fn torque(drive) -> i16 = sequence::torque(drive);

            /// Sets the drive up for a [cyclic](crate::cyclic) mode: PDOs, period, mode, and a set-point at its present
            /// position. It stays disabled, and nothing moves.
            ///
            /// Errors: [`Error::Sdo`] if the mapping of the drive is fixed.
            fn prepare_cyclic(drive, settings: AxisSettings) -> Axis = sequence::prepare_cyclic(drive, settings);

            /// Stops all movement with the programmed deceleration; returns once the drive stands. A travel is
            /// interrupted: [`Drive::resume`] goes on with it, and [`Drive::disable`] drops it. A step is ended by a
            /// quick stop, which leaves the drive in QUICK STOP ACTIVE.
            ///
            /// Errors: [`Error::NotStopped`], and those of SDO transfers.
            fn stop(drive) -> () = sequence::stop(drive);

            /// The actual position (6064h).
            fn position(drive) -> i32 = drive.position();

            /// The lowest and the highest position (607Dh); `None` if there are no limits.
            fn limits(drive) -> Option<(i32, i32)> = sequence::limits(drive);

            /// The actual velocity (606Ch).
            fn velocity(drive) -> i32 = drive.velocity();

            /// Homes by a method of 6098h, such as to a switch or an index pulse, and waits for the end. The drive then
            /// returns to its former mode, unless it is still under way.
            ///
            /// Errors: [`Error::Unsupported`], also if the drive does not have the method; [`Error::Refused`] before
            /// anything moves.
            fn home(drive, method: i8) -> HomingOutcome = sequence::home(drive, method, drive.patience());

            /// Makes `position` the actual position.
            ///
            /// Errors: [`Error::Refused`] while a travel is under way; [`Error::Sdo`] if it is outside the limits of
            /// travel.
            fn calibrate(drive, position: i32) -> () = sequence::calibrate(drive, position);

            /// Arms a latch, which keeps the position at the next edge. The position that it kept before is lost.
            ///
            /// Errors: [`Error::NotTaken`] if the drive does not clear the position that it kept before.
            fn arm_latch(drive, trigger: Trigger) -> () = sequence::arm_latch(drive, trigger);

            /// The position that a latch has kept since it was armed; `None` if no edge has come.
            fn latched(drive, trigger: Trigger) -> Option<i32> = sequence::latched(drive, trigger);

            /// Disarms a latch.
            fn disarm_latch(drive, trigger: Trigger) -> () = sequence::disarm_latch(drive, trigger);

            /// What the drive does in a situation: the option code in 605Ah to 605Eh.
            fn reaction(drive, to: Reaction) -> i16 = sequence::reaction(drive, to);

            /// Sets what the drive does in a situation.
            ///
            /// Errors: [`Error::Refused`] while a travel is under way.
            fn set_reaction(drive, to: Reaction, code: i16) -> () = sequence::set_reaction(drive, to, code);

            /// The side from which targets are approached; `None` for a value that the manual does not have.
            fn approach(drive) -> Option<Approach> = sequence::approach(drive);

            /// Chooses the side from which targets are approached (loop positioning).
            fn set_approach(drive, approach: Approach) -> () = sequence::set_approach(drive, approach);

            /// Reads all parameters of the manual's table.
            fn read_parameters(drive) -> Vec<Setting> = sequence::read_parameters(drive);

            /// The settings whose values differ in the drive.
            fn compare_parameters(drive, settings: &[Setting]) -> Vec<Difference> =
                sequence::compare_parameters(drive, settings);

            /// Writes those settings that differ.
            ///
            /// Errors: [`Error::NoParameter`] or [`Error::OutOfRange`] before anything is sent; [`Error::Refused`]
            /// while a travel is under way; [`Error::Sdo`] with the first setting that the drive refuses in every order
            /// of writing.
            fn write_parameters(drive, settings: &[Setting]) -> () = sequence::write_parameters(drive, settings);

            /// Stores all parameters permanently (1010h).
            ///
            /// Errors: [`Error::Unsupported`], also if the drive stores them by itself; [`Error::Refused`] while a
            /// travel is under way.
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

            /// Whether the load has stopped the drive (torque deactivation).
            fn torque_deactivated(drive) -> bool = sequence::torque_deactivated(drive);

            /// The load in % that stops a travel; `None` if none does.
            fn torque_threshold(drive) -> Option<u8> = sequence::torque_threshold(drive);

            /// Sets the load in % that stops a travel; with `None`, none does.
            fn set_torque_threshold(drive, percent: Option<u8>) -> () =
                sequence::set_torque_threshold(drive, percent);

            /// The version of the drive's firmware (100Ah): four characters, such as "1.00".
            fn firmware(drive) -> String = sequence::firmware(drive);

            /// Switches emergency messages on or off (1014h).
            ///
            /// Errors: [`Error::Sdo`] if the drive allows it in NMT PRE-OPERATIONAL only.
            fn set_emergencies(drive, on: bool) -> () = sequence::set_emergencies(drive, on);

            /// Configures PDOs of the application: each is disabled, mapped and enabled in NMT PRE-OPERATIONAL;
            /// afterwards the node is in OPERATIONAL.
            ///
            /// Errors: [`Error::PdoInUse`] for a PDO that the driver itself uses; [`Error::Refused`] while the drive is
            /// enabled; [`Error::Sdo`] if the drive does not allow it.
            fn configure_pdos(drive, pdos: &[PdoSettings<'_>]) -> () = sequence::configure_pdos(drive, pdos);

            /// The transmit PDOs (1 to 4) that may fill the bus while the drive moves: event-driven ones without an
            /// inhibit time. Many drives have them from the factory, and two such drives leave no room at 500 kbit/s
            /// for the SDOs of any node.
            fn unpaced_pdos(drive) -> Vec<UnpacedPdo> = sequence::unpaced_pdos(drive);

            /// Sends receive PDO `number` (1 to 4), mapped by the application.
            ///
            /// Errors: [`Error::PdoInUse`] for one that the driver itself uses.
            fn send_pdo [V: Values, N](drive, number: u16, mapping: &Mapping<Rpdo, V, N>, values: V) -> () =
                sequence::send_pdo(drive, number, mapping, values);

            /// The values of transmit PDO `number` (1 to 4), mapped by the application: of the last one if it has come
            /// since the previous call, or else of the next one.
            ///
            /// Errors: [`Error::NoPdo`], [`Error::ShortPdo`].
            fn receive_pdo [V: Values, N](drive, number: u16, mapping: &Mapping<Tpdo, V, N>) -> V =
                sequence::receive_pdo(drive, number, mapping);

            /// Reads an object.
            fn read [T: Value, A: Readable, M, D] (drive, object: Object<T, A, M, D>) -> T = drive.read(object);

            /// Writes an object.
            fn write [T: Value, A: Writable, M, D] (drive, object: Object<T, A, M, D>, value: T) -> () =
                drive.write(object, value);

            /// Waits, and keeps listening. While the drive may be moving, its status word is checked, and read if the
            /// drive sends none.
            ///
            /// Errors: [`Error::Link`], [`Error::Restarted`]; while the drive may be moving, also [`Error::Fault`], and
            /// [`Error::Sdo`] if it does not answer any more.
            fn pass(drive, span: Duration) -> () = sequence::pass(drive, span);
        }
    };
}

pub(crate) use operations;
