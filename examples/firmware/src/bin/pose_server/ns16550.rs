//! The UART of QEMU's `virt`, a 16550 (National Semiconductor, "PC16550D", 1995) with 16 bytes of buffer, without
//! interrupts; the machine has no pins.

use core::convert::Infallible;

use embedded_io::{Error, ErrorKind, ErrorType, Read, ReadReady, Write};

const UART: usize = 0x1000_0000;
/// Receive and transmit.
const DATA: usize = 0;
const FIFO_CONTROL: usize = 2;
const LINE_STATUS: usize = 5;
const DATA_READY: u8 = 1 << 0;
const OVERRUN: u8 = 1 << 1;
const TRANSMIT_EMPTY: u8 = 1 << 5;

fn read(register: usize) -> u8 {
    // SAFETY: a register of the UART.
    unsafe { ((UART + register) as *const u8).read_volatile() }
}

fn write(register: usize, value: u8) {
    // SAFETY: a register of the UART.
    unsafe { ((UART + register) as *mut u8).write_volatile(value) }
}

/// Nothing to sleep for: the UART is asked again.
pub(super) fn wait() {
    core::hint::spin_loop();
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

pub(super) struct Uart {
    /// The line's status as last read: reading it clears its errors.
    status: u8,
}

impl Uart {
    pub(super) fn new() -> Self {
        write(FIFO_CONTROL, 1);
        Self { status: 0 }
    }
}

impl ErrorType for Uart {
    type Error = Overrun;
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Overrun> {
        self.status = self.status & OVERRUN | read(LINE_STATUS);
        Ok(self.status & (DATA_READY | OVERRUN) != 0)
    }
}

impl Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        let Some(first) = buffer.first_mut() else { return Ok(0) };
        while !self.read_ready()? {}
        if self.status & OVERRUN != 0 {
            self.status = 0;
            return Err(Overrun);
        }
        *first = read(DATA);
        Ok(1)
    }
}

impl Write for Uart {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Overrun> {
        let Some(&first) = buffer.first() else { return Ok(0) };
        self.flush()?;
        write(DATA, first);
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Overrun> {
        loop {
            let status = read(LINE_STATUS);
            self.status |= status & OVERRUN;
            if status & TRANSMIT_EMPTY != 0 {
                return Ok(());
            }
        }
    }
}

/// No pin.
pub(super) struct DataReady(());

impl DataReady {
    pub(super) fn new() -> Self {
        Self(())
    }
}

impl embedded_hal::digital::ErrorType for DataReady {
    type Error = Infallible;
}

impl embedded_hal::digital::OutputPin for DataReady {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
