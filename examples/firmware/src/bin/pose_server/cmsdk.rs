//! UART 0 of the MPS2 boards with a Cortex-M3, M4 or M7, and a LED as the data-ready pin.
//!
//! The APB UART of Arm's Cortex-M System Design Kit (Technical Reference Manual, DDI 0479) holds one byte: its interrupt
//! puts bytes into a queue while the core computes.

use core::cell::RefCell;
use core::convert::Infallible;

use critical_section::Mutex;
use embedded_io::{Error, ErrorKind, ErrorType, Read, ReadReady, Write};
use heapless::Deque;

const UART0: usize = 0x4000_4000;
/// Byte offsets.
const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CONTROL: usize = 0x08;
const INTERRUPT: usize = 0x0c;
const DIVIDER: usize = 0x10;
const TRANSMIT_FULL: u32 = 1 << 0;
const RECEIVE_FULL: u32 = 1 << 1;
const RECEIVE_OVERRUN: u32 = 1 << 3;
/// Transmit, receive, receive interrupt.
const ENABLED: u32 = 1 << 0 | 1 << 1 | 1 << 3;
const RECEIVE_INTERRUPT: u32 = 1 << 1;
/// The peripheral clock of 25 MHz over 115,200 baud.
const DIVIDED: u32 = 217;
/// LEDs of the boards' FPGA (Arm application note 386).
const LEDS: usize = 0x4002_8000;

fn read(register: usize) -> u32 {
    // SAFETY: a register of the UART.
    unsafe { ((UART0 + register) as *const u32).read_volatile() }
}

fn write(register: usize, value: u32) {
    // SAFETY: a register of the UART.
    unsafe { ((UART0 + register) as *mut u32).write_volatile(value) }
}

struct Received {
    bytes: Deque<u8, 256>,
    /// The core was too slow for the line.
    lost: bool,
}

static RECEIVED: Mutex<RefCell<Received>> =
    Mutex::new(RefCell::new(Received { bytes: Deque::new(), lost: false }));

fn with_received<R>(call: impl FnOnce(&mut Received) -> R) -> R {
    critical_section::with(|token| call(&mut RECEIVED.borrow_ref_mut(token)))
}

impl Received {
    /// Takes what the UART holds. A full queue leaves it there: hardware flow control then stops the sender.
    fn fill(&mut self) {
        write(INTERRUPT, RECEIVE_INTERRUPT);
        while !self.bytes.is_full() {
            let state = read(STATE);
            if state & RECEIVE_OVERRUN != 0 {
                write(STATE, RECEIVE_OVERRUN);
                self.lost = true;
            }
            if state & RECEIVE_FULL == 0 {
                return;
            }
            let _ = self.bytes.push_back(read(DATA) as u8);
        }
    }
}

/// The first interrupt of the boards is that of bytes received by UART 0; no other is enabled.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) {
    with_received(Received::fill);
}

#[derive(Clone, Copy)]
struct Uart0Received;

// SAFETY: the number of that interrupt.
unsafe impl cortex_m::interrupt::InterruptNumber for Uart0Received {
    fn number(self) -> u16 {
        0
    }
}

/// Sleeps until there are bytes, or until the clock's interrupt.
pub(super) fn wait() {
    // An interrupt that is pending ends the sleep, masked or not: none can come between the question and the sleep.
    critical_section::with(|token| {
        if RECEIVED.borrow_ref(token).bytes.is_empty() {
            cortex_m::asm::wfi();
        }
    });
}

/// Bytes were lost.
#[derive(Debug)]
pub(super) struct Overrun;

impl core::fmt::Display for Overrun {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the receiver was too slow")
    }
}

impl core::error::Error for Overrun {}

impl Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

pub(super) struct Uart(());

impl Uart {
    pub(super) fn new() -> Self {
        write(DIVIDER, DIVIDED);
        write(CONTROL, ENABLED);
        // SAFETY: the handler touches the queue in a critical section alone.
        unsafe { cortex_m::peripheral::NVIC::unmask(Uart0Received) };
        Self(())
    }
}

impl ErrorType for Uart {
    type Error = Overrun;
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Overrun> {
        Ok(with_received(|received| {
            received.fill();
            received.lost || !received.bytes.is_empty()
        }))
    }
}

impl Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        let Some(first) = buffer.first_mut() else { return Ok(0) };
        loop {
            let taken = with_received(|received| {
                received.fill();
                if core::mem::take(&mut received.lost) {
                    Err(Overrun)
                } else {
                    Ok(received.bytes.pop_front())
                }
            });
            if let Some(byte) = taken? {
                *first = byte;
                return Ok(1);
            }
        }
    }
}

impl Write for Uart {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Overrun> {
        let Some(&first) = buffer.first() else { return Ok(0) };
        while read(STATE) & TRANSMIT_FULL != 0 {}
        write(DATA, u32::from(first));
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Overrun> {
        while read(STATE) & TRANSMIT_FULL != 0 {}
        Ok(())
    }
}

/// The first LED.
pub(super) struct DataReady(());

impl DataReady {
    pub(super) fn new() -> Self {
        Self(())
    }

    fn set(&mut self, high: bool) {
        // SAFETY: the register of the LEDs, which nothing else uses.
        unsafe { (LEDS as *mut u32).write_volatile(u32::from(high)) }
    }
}

impl embedded_hal::digital::ErrorType for DataReady {
    type Error = Infallible;
}

impl embedded_hal::digital::OutputPin for DataReady {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(true);
        Ok(())
    }
}
