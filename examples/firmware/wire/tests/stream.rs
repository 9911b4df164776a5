//! A hundred thousand frames, most of them damaged, in one stream: the decoder finds what a slow and plain reading of the
//! format finds, and every frame that was not damaged.

use epipole_client::damage::{Damage, Sent, below, reference, send};
use epipole_problems::random::SplitMix64;
use epipole_wire::{Decoder, Reason};

const FRAMES: usize = 100_000;
const CAPACITY: usize = 600;

/// Numbered frames with random bodies, about a third of them whole.
fn stream(seed: u64) -> Vec<Sent> {
    let mut random = SplitMix64(seed);
    let random = &mut random;
    (0..FRAMES)
        .map(|k| {
            let length = match below(random, 4) {
                0 => below(random, 8),
                1 => below(random, 64),
                _ => below(random, CAPACITY - 8),
            };
            // Many zeros, or none at all.
            let zeros = below(random, 3);
            let body = (0..length).map(|_| match zeros {
                0 => random.bits() as u8,
                1 => (random.bits() % 3) as u8,
                _ => random.bits() as u8 | 1,
            });
            let body: Vec<u8> = body.collect();
            let damage = Damage::any(random);
            send(random, damage, 1 + (k % 4) as u8, k as u16, body, CAPACITY)
        })
        .collect()
}

#[test]
fn every_good_frame_is_found_and_every_bad_one_is_counted() {
    let sent = stream(1);
    let line: Vec<u8> = sent.iter().flat_map(|frame| frame.bytes.iter().copied()).chain([0]).collect();

    // By the plain reading: what stands between two delimiters is a frame.
    let expected: Vec<_> =
        line.split(|&b| b == 0).filter(|c| !c.is_empty()).map(|c| reference(c, CAPACITY)).collect();

    let mut buffer = vec![0; CAPACITY];
    let mut decoder = Decoder::new(&mut buffer);
    let mut found = Vec::new();
    for &byte in &line {
        if let Some(outcome) = decoder.feed(byte) {
            found.push(
                outcome.map(|f| (f.kind, f.sequence, f.body.to_vec())).map_err(|r| (r.sequence, r.reason)),
            );
        }
    }
    assert!(!decoder.pending());
    assert_eq!(found.len(), expected.len());
    for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
        assert_eq!(found, expected, "frame {k}");
    }

    // In order, every frame that left its sender whole is among them.
    let mut good = found.iter().filter_map(|outcome| outcome.as_ref().ok());
    let whole = sent.iter().filter(|frame| frame.damage == Damage::None);
    let mut count = 0;
    for frame in whole {
        count += 1;
        assert!(
            good.any(|(_, sequence, body)| (*sequence, body) == (frame.sequence, &frame.body)),
            "{frame:?}"
        );
    }
    assert!(count > FRAMES / 4, "{count}");
    // Each way of going wrong was met.
    for reason in [
        Reason::Malformed,
        Reason::Checksum,
        Reason::TooLong { capacity: CAPACITY as u32 },
        Reason::Version { supported: 1 },
    ] {
        let met = found.iter().filter(|outcome| matches!(outcome, Err((_, r)) if *r == reason)).count();
        assert!(met > FRAMES / 200, "{reason:?}: {met}");
    }
}

#[test]
fn a_frame_that_is_given_up_takes_no_other_with_it() {
    let mut out = [0; 64];
    let length = epipole_wire::encode(&mut out, 3, 7, |_| ()).unwrap();
    let frame = &out[..length];
    let mut buffer = [0; 64];
    let mut decoder = Decoder::new(&mut buffer);
    for cut in 1..length {
        for &byte in &frame[..cut] {
            assert!(decoder.feed(byte).is_none());
        }
        let pending = decoder.pending();
        assert_eq!(pending, cut > 1);
        decoder.give_up();
        assert!(!decoder.pending());
        // Its rest, if it comes after all, is no frame of its own.
        if pending {
            for &byte in &frame[cut..] {
                assert!(decoder.feed(byte).is_none());
            }
        }
        let answers: Vec<bool> =
            frame.iter().filter_map(|&byte| decoder.feed(byte).map(|outcome| outcome.is_ok())).collect();
        assert_eq!(answers, [true]);
    }
}
