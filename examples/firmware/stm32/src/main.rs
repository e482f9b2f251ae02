//! The I/O device on an STM32G474RE with FDCAN, as on ST's NUCLEO-G474RE with a CAN transceiver at PB8 and PB9.
//!
//! Compiled in CI, but never run on a board. Wiring: digital port 1 has inputs PC0 to PC7 and outputs PB0 to PB2, PB4
//! to PB7 and PB10; analogue inputs 1 and 2 are PA0 and PA1; analogue output 1 is PA4. Parameters are stored in the
//! last pages of the flash.
#![no_std]
#![no_main]

use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_futures::select::{Either, select};
use embassy_stm32::adc::{Adc, AdcChannel, AnyAdcChannel, SampleTime};
use embassy_stm32::can::{self, Can, CanConfigurator};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::flash::{Blocking, FLASH_SIZE, Flash};
use embassy_stm32::gpio::{AnyPin, Input, Level, Output, Pull, Speed};
use embassy_stm32::mode;
use embassy_stm32::peripherals::{ADC1, FDCAN1};
use embassy_stm32::rcc::{Hse, HseMode, Sysclk, mux};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peri, bind_interrupts};
use embassy_time::{Instant, Timer};
use io_device::{Board, Channels, IoDevice, NOTEBOOK};
use lexican_runtime::{FlashSlots, Frame};
use panic_probe as _;

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => can::IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => can::IT1InterruptHandler<FDCAN1>;
});

const BIT_RATE: u32 = 500_000;

/// The size of each of the two slots at the end of the flash: two pages.
const SLOT: u32 = 4096;

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let mut config = Config::default();
    // Use the crystal: the internal oscillator is not accurate enough for CAN.
    config.rcc.hse = Some(Hse { freq: Hertz(24_000_000), mode: HseMode::Oscillator });
    config.rcc.sys = Sysclk::HSE;
    config.rcc.mux.fdcansel = mux::Fdcansel::HSE;
    let p = embassy_stm32::init(config);

    let mut can = CanConfigurator::new(p.FDCAN1, p.PB8, p.PB9, Interrupts);
    can.set_bitrate(BIT_RATE);
    let mut can = can.into_normal_mode();

    let input = |pin: Peri<'static, AnyPin>| Input::new(pin, Pull::Down);
    let output = |pin: Peri<'static, AnyPin>| Output::new(pin, Level::Low, Speed::Low);
    let terminals = Terminals {
        inputs: [
            input(p.PC0.into()),
            input(p.PC1.into()),
            input(p.PC2.into()),
            input(p.PC3.into()),
            input(p.PC4.into()),
            input(p.PC5.into()),
            input(p.PC6.into()),
            input(p.PC7.into()),
        ],
        outputs: [
            output(p.PB0.into()),
            output(p.PB1.into()),
            output(p.PB2.into()),
            output(p.PB4.into()),
            output(p.PB5.into()),
            output(p.PB6.into()),
            output(p.PB7.into()),
            output(p.PB10.into()),
        ],
        adc: Adc::new(p.ADC1, Default::default()),
        channels: [p.PA0.degrade_adc(), p.PA1.degrade_adc()],
        dac: DacChannel::new_blocking(p.DAC1, p.PA4),
    };
    let flash = Flash::new_blocking(p.FLASH);
    let slots = FlashSlots::new(flash, FLASH_SIZE as u32 - 2 * SLOT, SLOT).expect("two slots of whole pages");
    let notebook = cortex_m::singleton!(: [u8; NOTEBOOK] = [0; NOTEBOOK]).expect("main runs once");
    let mut device = IoDevice::new(now(), terminals, slots, notebook);
    defmt::info!("the device runs");
    loop {
        transmit(&mut device, &mut can).await;
        let timeout = Timer::at(Instant::from_micros(device.poll_timeout().as_micros()));
        match select(can.read(), timeout).await {
            Either::First(Ok(received)) => {
                if let Some(frame) = Frame::from_embedded(&received.frame) {
                    device.handle_frame(now(), &frame);
                }
            }
            // The controller returns to the bus by itself.
            Either::First(Err(error)) => defmt::warn!("CAN: {}", error),
            Either::Second(()) => device.handle_timeout(now()),
        }
    }
}

async fn transmit(device: &mut IoDevice<Terminals<'_>, FlashSlots<Flash<'_, Blocking>>>, can: &mut Can<'_>) {
    while let Some(frame) = device.poll_transmit(now()) {
        if let Some(frame) = frame.to_embedded() {
            // If the controller evicts a frame of lower priority for this one, send that next.
            let mut next = Some(frame);
            while let Some(frame) = next {
                next = can.write(&frame).await;
            }
        }
    }
}

fn now() -> lexican_runtime::Instant {
    lexican_runtime::Instant::from_micros(Instant::now().as_micros())
}

/// What is connected to the controller.
struct Terminals<'d> {
    inputs: [Input<'d>; 8],
    outputs: [Output<'d>; 8],
    adc: Adc<'d, ADC1>,
    channels: [AnyAdcChannel<'d, ADC1>; 2],
    dac: DacChannel<'d, mode::Blocking>,
}

impl Board for Terminals<'_> {
    fn inputs(&mut self) -> Channels {
        let mut channels = Channels::default();
        let [port, _] = &mut channels.digital;
        *port = self.inputs.iter().rev().fold(0, |bits, input| bits << 1 | u8::from(input.is_high()));
        for (value, channel) in channels.analogue.iter_mut().zip(&mut self.channels) {
            // 12 bits, aligned to 15: the voltage has no sign.
            *value = (self.adc.blocking_read(channel, SampleTime::CYCLES24_5) << 3) as i16;
        }
        channels
    }

    fn set_outputs(&mut self, outputs: &Channels) {
        let [port, _] = outputs.digital;
        for (bit, output) in self.outputs.iter_mut().enumerate() {
            output.set_level(Level::from(port >> bit & 1 != 0));
        }
        let [voltage, ..] = outputs.analogue;
        self.dac.set(Value::Bit12Right(voltage.max(0) as u16 >> 3));
    }

    fn unused_stack(&mut self) -> u32 {
        unsafe extern "C" {
            static _stack_end: u32;
            static _stack_start: u32;
        }
        let (end, start) = (&raw const _stack_end, &raw const _stack_start);
        // SAFETY: the words between the two symbols are memory, which cortex-m-rt has painted.
        let words = (0..start as usize - end as usize).step_by(4).map(|at| unsafe { end.byte_add(at).read_volatile() });
        4 * words.take_while(|word| *word == cortex_m_rt::STACK_PAINT_VALUE).count() as u32
    }
}
