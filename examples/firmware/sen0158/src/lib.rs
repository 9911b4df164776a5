//! PixArt's infrared camera with four tracked points, as sold as DFRobot SEN0158, over [`embedded_hal::i2c::I2c`].
//!
//! The sensor has 128 x 96 pixels behind an infrared filter and tells the centres of up to four bright blobs in eighths of
//! them: 1024 x 768. There is no public data sheet. The facts, and where they are from:
//!
//! | fact | source |
//! |---|---|
//! | address 0x58 (0xB0 with the direction bit), the six writes of the initialisation, 10 ms after each and 100 ms after all | [DFRobot wiki, SEN0158](https://wiki.dfrobot.com/sen0158/docs/20468) |
//! | 16 bytes from register 0x36: a header, then for each blob x, y and `yyxxssss`, high bits first; 1023 is an empty slot; slots are in the order of detection, and a slot keeps its blob while it sees it | the same |
//! | field of view 33 x 23 degrees, range 3 m, 3.3 to 5 V | [DFRobot wiki, SEN0158](https://wiki.dfrobot.com/sen0158/) |
//! | `ssss` is the blob's size; 0x30 starts (1) and ends (8) the configuration, 0x06 is the largest size, 0x08 the gain, 0x1A its limit, 0x33 the format | [Wiimote wiki, IR Sensor](http://wiki.wiimoteproject.com/IR_Sensor), whose remote has the same sensor |
//! | a reading is not atomic: the sensor writes while it is read, about 209 times a second; y from 768 to 1022 then appears; two equal readings in a row are whole | README of DFRobotIRPositionEx in TeamOpenFIRE/OpenFIRE-Firmware |
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

use core::fmt;

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;

/// The sensor's address on the bus.
pub const ADDRESS: u8 = 0x58;
/// Columns of its coordinates.
pub const WIDTH: u16 = 1024;
/// Rows of its coordinates.
pub const HEIGHT: u16 = 768;
/// What is written to configure it: register and value.
pub const CONFIGURATION: [[u8; 2]; 6] =
    [[0x30, 0x01], [0x30, 0x08], [0x06, 0x90], [0x08, 0xc0], [0x1a, 0x40], [0x33, 0x33]];
/// Where a reading begins.
pub const READING: u8 = 0x36;
/// Readings at the most until two in a row are equal.
pub const MAX_READINGS: u32 = 5;

/// A bright spot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blob {
    /// Column, from the left.
    pub x: u16,
    /// Row, from the top.
    pub y: u16,
    /// Its size, 0 to 15, in no unit.
    pub size: u8,
}

/// The four slots of a reading.
pub type Blobs = [Option<Blob>; 4];

/// Why there is no reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus failed, or no sensor answers at the address.
    Bus(E),
    /// No two readings in a row were equal and possible: the bus is too slow for the motion, or disturbed.
    Torn,
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Self::Bus(error)
    }
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(f, "the bus: {error:?}"),
            Self::Torn => f.write_str("no two readings in a row agree"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for Error<E> {}

/// The sensor on its bus.
#[derive(Debug)]
pub struct Sen0158<I> {
    bus: I,
}

impl<I: I2c> Sen0158<I> {
    /// A sensor that still is to be configured.
    pub fn new(bus: I) -> Self {
        Self { bus }
    }

    /// Configures the sensor and starts it; 160 ms. Again after an error of the bus, which may have been the supply's.
    ///
    /// # Errors
    /// [`Error::Bus`], at the first write that is not acknowledged.
    pub fn configure(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<I::Error>> {
        for write in &CONFIGURATION {
            self.bus.write(ADDRESS, write)?;
            delay.delay_ms(10);
        }
        delay.delay_ms(100);
        Ok(())
    }

    /// The blobs now, from two equal readings in a row; at most [`MAX_READINGS`].
    ///
    /// # Errors
    /// [`Error::Bus`]; [`Error::Torn`] where no two in a row were equal, or they tell what cannot be.
    pub fn blobs(&mut self) -> Result<Blobs, Error<I::Error>> {
        let mut before = None;
        for _ in 0..MAX_READINGS {
            let reading = self.reading()?;
            if before == Some(reading)
                && let Some(blobs) = decode(&reading)
            {
                return Ok(blobs);
            }
            before = Some(reading);
        }
        Err(Error::Torn)
    }

    /// The bus back.
    pub fn release(self) -> I {
        self.bus
    }

    fn reading(&mut self) -> Result<[u8; 16], Error<I::Error>> {
        let mut reading = [0; 16];
        self.bus.write(ADDRESS, &[READING])?;
        self.bus.read(ADDRESS, &mut reading)?;
        Ok(reading)
    }
}

/// The blobs that a reading tells; none where it tells what cannot be: a row below the image.
#[must_use]
pub fn decode(reading: &[u8; 16]) -> Option<Blobs> {
    let mut blobs = [None; 4];
    let [_, slots @ ..] = reading;
    for (blob, slot) in blobs.iter_mut().zip(slots.chunks_exact(3)) {
        let &[x, y, high] = slot else { continue };
        let x = u16::from(x) | u16::from(high & 0x30) << 4;
        let y = u16::from(y) | u16::from(high & 0xc0) << 2;
        *blob = match (x, y) {
            (1023, 1023) => None,
            (x, y) if y < HEIGHT => Some(Blob { x, y, size: high & 0x0f }),
            _ => return None,
        };
    }
    Some(blobs)
}

/// The reading that tells these blobs: what a simulated sensor answers.
#[must_use]
pub fn encode(blobs: &Blobs) -> [u8; 16] {
    let mut reading = [0xff; 16];
    let [header, slots @ ..] = &mut reading;
    *header = 0;
    for (blob, slot) in blobs.iter().zip(slots.chunks_exact_mut(3)) {
        if let (Some(blob), [x, y, high]) = (blob, slot) {
            (*x, *y) = (blob.x as u8, blob.y as u8);
            *high = ((blob.y >> 2) as u8 & 0xc0) | ((blob.x >> 4) as u8 & 0x30) | (blob.size & 0x0f);
        }
    }
    reading
}
