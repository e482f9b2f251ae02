//! Timer, UART, interrupts and stack of the board: addresses and bits from Arm's AN386, the CMSDK and the ARMv7-M
//! manuals.

use lexican_runtime::Instant;

/// A 32-bit register at one of the addresses below.
#[derive(Clone, Copy)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: a register of a peripheral that this file alone uses; reading one touches no memory.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: a register of a peripheral that this file alone uses; writing one touches no memory.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

const TIMER_CONTROL: Register = Register(0x4000_0000);
const TIMER_VALUE: Register = Register(0x4000_0004);
const TIMER_RELOAD: Register = Register(0x4000_0008);
const TICKS_PER_US: u64 = 25;

const UART_DATA: Register = Register(0x4000_4000);
const UART_STATE: Register = Register(0x4000_4004);
const UART_CONTROL: Register = Register(0x4000_4008);
const UART_INTERRUPTS: Register = Register(0x4000_400C);
const UART_DIVIDER: Register = Register(0x4000_4010);
const SENDER_IS_FULL: u32 = 1 << 0;
const RECEIVER_IS_FULL: u32 = 1 << 1;
/// Enables transmitter, receiver, and the receiver's interrupt.
const UART_IS_ON: u32 = 1 << 0 | 1 << 1 | 1 << 3;
const RECEIVED: u32 = 1 << 1;

const SYSTICK_CONTROL: Register = Register(0xE000_E010);
const SYSTICK_RELOAD: Register = Register(0xE000_E014);
const SYSTICK_VALUE: Register = Register(0xE000_E018);
/// Enables counter and interrupt, with the processor clock.
const SYSTICK_IS_ON: u32 = 0b111;

const INTERRUPTS_ENABLED: Register = Register(0xE000_E100);
const INTERRUPTS_PENDING_CLEAR: Register = Register(0xE000_E280);
/// The receive interrupt of UART 0.
const RECEIVER: u32 = 1 << 0;
const INTERRUPT_STATE: Register = Register(0xE000_ED04);
const SYSTICK_PENDING_CLEAR: u32 = 1 << 25;

/// The time since power-on.
pub struct Clock {
    /// The last value of the timer, which counts down and wraps around every 171 s.
    last: u32,
    ticks: u64,
}

impl Clock {
    pub fn start() -> Self {
        TIMER_RELOAD.write(u32::MAX);
        TIMER_VALUE.write(u32::MAX);
        TIMER_CONTROL.write(1);
        // Ticks every millisecond, to end a wait.
        SYSTICK_RELOAD.write(1000 * TICKS_PER_US as u32 - 1);
        SYSTICK_VALUE.write(0);
        SYSTICK_CONTROL.write(SYSTICK_IS_ON);
        Clock { last: u32::MAX, ticks: 0 }
    }

    pub fn now(&mut self) -> Instant {
        let value = TIMER_VALUE.read();
        self.ticks += u64::from(self.last.wrapping_sub(value));
        self.last = value;
        Instant::from_micros(self.ticks / TICKS_PER_US)
    }
}

/// UART 0.
pub struct Uart(());

impl Uart {
    pub fn start() -> Self {
        UART_DIVIDER.write(16);
        UART_CONTROL.write(UART_IS_ON);
        INTERRUPTS_ENABLED.write(RECEIVER);
        Uart(())
    }

    pub fn send(&mut self, byte: u8) {
        while UART_STATE.read() & SENDER_IS_FULL != 0 {}
        UART_DATA.write(byte.into());
    }

    pub fn receive(&mut self) -> Option<u8> {
        (UART_STATE.read() & RECEIVER_IS_FULL != 0).then(|| UART_DATA.read() as u8)
    }
}

/// Waits for a byte or for the next millisecond.
pub fn wait() {
    // Interrupts are masked: a pending one ends the wait, and is cleared here.
    cortex_m::asm::wfi();
    UART_INTERRUPTS.write(RECEIVED);
    INTERRUPTS_PENDING_CLEAR.write(RECEIVER);
    INTERRUPT_STATE.write(SYSTICK_PENDING_CLEAR);
}

/// The number of stack bytes that still have the pattern written by cortex-m-rt at the start.
pub fn unused_stack() -> u32 {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let (end, start) = (&raw const _stack_end as usize, &raw const _stack_start as usize);
    // Read the memory as a register, because the compiler does not know its contents.
    let words = (end..start).step_by(4).map(|address| Register(address).read());
    4 * words.take_while(|word| *word == cortex_m_rt::STACK_PAINT_VALUE).count() as u32
}
