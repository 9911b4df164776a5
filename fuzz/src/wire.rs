//! Arbitrary bytes through the wire format of `examples/firmware`: what the decoder finds in a stream is what a plain
//! reading finds, and whatever a frame holds is read without a panic.

use epipole_client::damage::{by_hand, reference};
use epipole_wire::{Decoder, Frame, Reply, Request, VERSION};

/// The first byte chooses: a stream of bytes for a decoder with so much room, or the body of a frame whose checksum is
/// right, which random bytes would hardly ever be. Panics where a promise is broken.
pub fn run(data: &[u8]) {
    let Some((&choice, data)) = data.split_first() else { return };
    if choice & 1 == 0 {
        stream(data, usize::from(choice));
    } else if let Some((&kind, body)) = data.split_first() {
        let line = by_hand(VERSION, kind, u16::from(choice), body);
        assert_eq!(stream(&line, body.len() + 8), 1, "a whole frame was not found");
    }
}

/// How many whole frames there are.
fn stream(line: &[u8], capacity: usize) -> usize {
    let mut buffer = vec![0; capacity];
    let mut decoder = Decoder::new(&mut buffer);
    let mut whole = 0;
    let mut expected = line
        .split_inclusive(|&byte| byte == 0)
        .filter_map(|chunk| chunk.strip_suffix(&[0]))
        .filter(|chunk| !chunk.is_empty())
        .map(|chunk| reference(chunk, capacity));
    for &byte in line {
        let Some(found) = decoder.feed(byte) else { continue };
        whole += usize::from(found.is_ok());
        found.iter().for_each(read);
        let found = found.map(|f| (f.kind, f.sequence, f.body.to_vec())).map_err(|r| (r.sequence, r.reason));
        assert_eq!(Some(found), expected.next());
    }
    assert_eq!(None, expected.next(), "a frame was lost");
    whole
}

/// As a request and as a reply.
fn read(frame: &Frame<'_>) {
    match Request::parse(frame) {
        Ok(Request::RelativePose(request)) => {
            assert_eq!(request.correspondences.iter().count(), request.correspondences.len());
        }
        Ok(Request::AbsolutePose(request)) => {
            assert_eq!(request.correspondences.iter().count(), request.correspondences.len());
        }
        _ => {}
    }
    match Reply::parse(frame) {
        Some(Reply::RelativePose(answer)) => drop(answer.inliers.iter().count()),
        Some(Reply::AbsolutePose(answer)) => drop(answer.inliers.iter().count()),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use epipole_client::damage::{Damage, below, send};
    use epipole_client::problems::synthetic;
    use epipole_problems::random::SplitMix64;

    use super::run;

    /// Frames damaged in every way, bodies of every kind and requests with a few bytes changed, the same on every machine.
    #[test]
    fn fixed_inputs_break_no_promise() {
        let mut random = SplitMix64(1);
        let random = &mut random;
        for _ in 0..20_000 {
            let body: Vec<u8> = (0..below(random, 200)).map(|_| random.bits() as u8).collect();
            let capacity = below(random, 128) * 2;
            let mut input = vec![capacity as u8];
            for _ in 0..3 {
                let damage = Damage::any(random);
                input.extend(send(random, damage, 1, 1, body.clone(), capacity.max(1)).bytes);
            }
            run(&input);
            let kind = [1, 2, 3, 4, 0x81, 0x82, 0x83, 0xff][below(random, 8)];
            run(&[&[1, kind][..], &body].concat());
        }
        for k in 0..2_000 {
            let request = synthetic(k, 1, 12, 0);
            let (kind, _, mut body) =
                super::reference(&request[1..request.len() - 1], 4096).expect("a whole frame");
            for _ in 0..below(random, 4) {
                let at = below(random, body.len());
                body[at] = random.bits() as u8;
            }
            run(&[&[1, kind][..], &body].concat());
        }
    }
}
