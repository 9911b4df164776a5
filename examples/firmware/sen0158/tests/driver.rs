//! The driver against a bus that expects every transaction.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::delay::CheckedDelay;
use embedded_hal_mock::eh1::delay::Transaction as Wait;
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
use epipole_sen0158::{Blob, CONFIGURATION, Error, MAX_READINGS, Sen0158, decode, encode};

const NOBODY: ErrorKind = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);

/// Bytes as a logic analyser would show them: one blob at (0x1A5, 0x2C3) of size 7, three empty slots.
const ONE: [u8; 16] =
    [0x00, 0xa5, 0xc3, 0x97, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];

fn readings(readings: &[[u8; 16]]) -> Vec<Transaction> {
    readings
        .iter()
        .flat_map(|r| [Transaction::write(0x58, vec![0x36]), Transaction::read(0x58, r.to_vec())])
        .collect()
}

fn read(expected: &[Transaction]) -> Result<epipole_sen0158::Blobs, Error<ErrorKind>> {
    let mut bus = Mock::new(expected);
    let result = Sen0158::new(bus.clone()).blobs();
    bus.done();
    result
}

#[test]
fn it_is_configured_as_its_maker_does() {
    let writes: Vec<_> = [(0x30, 0x01), (0x30, 0x08), (0x06, 0x90), (0x08, 0xc0), (0x1a, 0x40), (0x33, 0x33)]
        .map(|(register, value)| Transaction::write(0x58, vec![register, value]))
        .to_vec();
    let mut waits = vec![Wait::delay_ms(10); 6];
    waits.push(Wait::delay_ms(100));
    let (mut bus, mut delay) = (Mock::new(&writes), CheckedDelay::new(&waits));
    let mut sensor = Sen0158::new(bus.clone());
    assert_eq!(sensor.configure(&mut delay), Ok(()));
    drop(sensor.release());
    bus.done();
    delay.done();
}

#[test]
fn an_absent_sensor_is_told_at_once() {
    for silent in 0..CONFIGURATION.len() {
        let mut writes: Vec<_> =
            CONFIGURATION[..=silent].iter().map(|w| Transaction::write(0x58, w.to_vec())).collect();
        writes[silent] = writes[silent].clone().with_error(NOBODY);
        let mut bus = Mock::new(&writes);
        let mut delay = CheckedDelay::new(&vec![Wait::delay_ms(10); silent]);
        assert_eq!(Sen0158::new(bus.clone()).configure(&mut delay), Err(Error::Bus(NOBODY)));
        bus.done();
        delay.done();
    }
}

#[test]
fn slots_may_be_empty() {
    let expected = [Some(Blob { x: 0x1a5, y: 0x2c3, size: 7 }), None, None, None];
    assert_eq!(read(&readings(&[ONE, ONE])), Ok(expected));
    let mut none = [0xff; 16];
    none[0] = 0;
    assert_eq!(read(&readings(&[none, none])), Ok([None; 4]));
}

#[test]
fn a_reading_that_the_sensor_wrote_meanwhile_is_read_again() {
    let mut moved = ONE;
    moved[1] = 0xa7;
    // The low byte of x is old, its high bits are new: the next two agree.
    assert_eq!(read(&readings(&[ONE, moved, moved])).map(|blobs| blobs[0].unwrap().x), Ok(0x1a7));
    let [mut a, mut b] = [ONE; 2];
    (a[1], b[1]) = (1, 2);
    assert_eq!(read(&readings(&[a, b, a, b, a])), Err(Error::Torn));
}

#[test]
fn a_row_below_the_image_is_torn_even_twice() {
    let mut low = ONE;
    (low[2], low[3]) = (0x00, 0xd7); // y = 768
    assert_eq!(read(&readings(&vec![low; MAX_READINGS as usize])), Err(Error::Torn));
    assert_eq!(read(&readings(&[low, low, ONE, ONE])).map(|blobs| blobs[0].is_some()), Ok(true));
    // y tells an empty slot, x does not.
    (low[1], low[2], low[3]) = (0x10, 0xff, 0xff);
    assert_eq!(decode(&low), None);
}

#[test]
fn errors_of_the_bus_pass_through_and_the_next_reading_is_good() {
    for broken in 0..4 {
        let mut expected = readings(&[ONE, ONE]);
        expected.truncate(broken + 1);
        expected[broken] = expected[broken].clone().with_error(ErrorKind::ArbitrationLoss);
        expected.extend(readings(&[ONE, ONE]));
        let mut bus = Mock::new(&expected);
        let mut sensor = Sen0158::new(bus.clone());
        assert_eq!(sensor.blobs(), Err(Error::Bus(ErrorKind::ArbitrationLoss)));
        assert!(sensor.blobs().is_ok());
        bus.done();
    }
}

#[test]
fn every_place_and_size_comes_back() {
    for x in 0..1024 {
        for y in (0..768).step_by(7) {
            let blob = Some(Blob { x, y, size: ((x + y) % 16) as u8 });
            let blobs = [None, blob, None, blob];
            assert_eq!(decode(&encode(&blobs)), Some(blobs));
        }
    }
}
