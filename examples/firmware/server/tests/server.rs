//! The server over lines, pins and clocks in memory.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;

use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use epipole::InputError;
use epipole::robust::{OptionsError, StopReason};
use epipole_client::answers::{Library, frames};
use epipole_client::damage::{Damage, Outcome, below, by_hand, reference, send};
use epipole_client::problems::synthetic;
use epipole_problems::random::SplitMix64;
use epipole_server::{Activity, Clock, Limits, Memory, Server, frame_bytes};
use epipole_wire::{Frame, Order, Reason, Refusal, Reply, Request, Statistics, VERSION, kind};

const N: usize = 100;
const BYTES: usize = frame_bytes(N);
type Room = Memory<N, BYTES>;

/// What happens on the line.
#[derive(Clone, Copy, PartialEq)]
enum Event {
    Byte(u8),
    /// The receiver reports a lost byte.
    Error,
    /// Nothing for so many microseconds.
    Silence(u64),
}

#[derive(Clone, Default)]
struct World {
    input: Rc<RefCell<VecDeque<Event>>>,
    output: Rc<RefCell<Vec<u8>>>,
    now_us: Rc<Cell<u64>>,
    /// Microseconds that pass with each look at the clock.
    step_us: Rc<Cell<u64>>,
    deaf: Rc<Cell<bool>>,
    switches: Rc<Cell<u32>>,
}

impl World {
    fn push(&self, bytes: &[u8]) {
        self.input.borrow_mut().extend(bytes.iter().map(|&byte| Event::Byte(byte)));
    }

    /// Polls until there is nothing more to do.
    fn run(&self, server: &mut Server<'_, World, World, World>) -> Vec<Activity> {
        let mut activities = Vec::new();
        loop {
            let activity = server.poll();
            if activity != Activity::Idle {
                activities.push(activity);
            } else if self.input.borrow().is_empty() {
                return activities;
            }
        }
    }

    fn replies(&self, mut each: impl FnMut(&Frame<'_>, &Reply<'_>, &[u8])) {
        let output = std::mem::take(&mut *self.output.borrow_mut());
        frames(&output, |frame, bytes| each(frame, &Reply::parse(frame).expect("a reply"), bytes));
    }

    fn server<'m>(&self, memory: &'m mut Room) -> Server<'m, World, World, World> {
        Server::new(memory, self.clone(), self.clone(), self.clone(), Limits::default())
    }
}

impl ErrorType for World {
    type Error = ErrorKind;
}

impl ReadReady for World {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        let mut input = self.input.borrow_mut();
        if let Some(&Event::Silence(us)) = input.front() {
            self.now_us.set(self.now_us.get() + us);
            input.pop_front();
            return Ok(false);
        }
        Ok(!input.is_empty())
    }
}

impl Read for World {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        match self.input.borrow_mut().pop_front() {
            Some(Event::Byte(byte)) => {
                buffer[0] = byte;
                Ok(1)
            }
            _ => Err(ErrorKind::Other),
        }
    }
}

impl Write for World {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, ErrorKind> {
        if self.deaf.get() {
            return Err(ErrorKind::BrokenPipe);
        }
        // A few bytes at a time, as a UART's buffer would.
        let taken = &buffer[..buffer.len().min(7)];
        self.output.borrow_mut().extend(taken);
        Ok(taken.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

impl Clock for World {
    fn now_us(&mut self) -> u64 {
        self.now_us.set(self.now_us.get() + self.step_us.get());
        self.now_us.get()
    }
}

impl embedded_hal::digital::ErrorType for World {
    type Error = std::convert::Infallible;
}

impl embedded_hal::digital::OutputPin for World {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        self.switches.set(self.switches.get() + 1);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Self::Error> {
        self.set_low()
    }
}

fn whole(bytes: &[u8]) -> (u8, u16, Vec<u8>) {
    reference(&bytes[1..bytes.len() - 1], usize::MAX).unwrap()
}

#[test]
fn answers_have_the_librarys_bits() {
    let (world, mut memory, mut library) = (World::default(), Box::new(Room::new()), Library::default());
    let mut server = world.server(&mut memory);
    let mut verdicts = std::collections::BTreeMap::new();
    for k in 0..400 {
        let sent = synthetic(k, k as u16, N, 10_000);
        world.push(&sent);
        assert_eq!(world.run(&mut server), [Activity::Answered], "problem {k}");
        let (kind, sequence, body) = whole(&sent);
        world.replies(|_, reply, bytes| {
            let request = Frame { kind, sequence, body: &body };
            assert_eq!(library.expected(&request, reply).as_deref(), Some(bytes), "problem {k}: {reply:?}");
            let verdict = match reply {
                Reply::RelativePose(answer) => format!("{:?}", answer.estimate.verdict),
                Reply::AbsolutePose(answer) => format!("absolute {:?}", answer.estimate.verdict),
                other => panic!("{other:?}"),
            };
            let name: String = verdict.chars().take_while(|c| !"({".contains(*c)).collect();
            *verdicts.entry(name).or_insert(0) += 1;
        });
    }
    assert_eq!(server.statistics().answered, 400);
    assert!(verdicts.len() >= 5, "{verdicts:?}");
}

#[test]
fn a_deadline_ends_the_search_early_and_the_answer_is_that_of_as_many_iterations() {
    let (world, mut memory, mut library) = (World::default(), Box::new(Room::new()), Library::default());
    let mut server = world.server(&mut memory);
    let mut interrupted = 0;
    for k in 0..100 {
        // One look at the clock for every eight iterations: some searches end by themselves.
        world.step_us.set(1_000_000 / (1 + u64::from(k % 7)));
        let sent = synthetic(k, k as u16, N, 10_000);
        world.push(&sent);
        world.run(&mut server);
        let (kind, sequence, body) = whole(&sent);
        world.replies(|_, reply, bytes| {
            let request = Frame { kind, sequence, body: &body };
            assert_eq!(library.expected(&request, reply).as_deref(), Some(bytes), "problem {k}");
            let (report, elapsed_us) = match reply {
                Reply::RelativePose(answer) => (answer.estimate.report, answer.elapsed_us),
                Reply::AbsolutePose(answer) => (answer.estimate.report, answer.elapsed_us),
                other => panic!("{other:?}"),
            };
            assert!(elapsed_us > 0);
            if report.stop == StopReason::Interrupted {
                interrupted += 1;
                assert!(report.spent.iterations <= 8 * 8);
            }
        });
    }
    assert!((20..100).contains(&interrupted), "{interrupted}");
    assert_eq!(server.statistics().interrupted, interrupted);
}

/// The body of a request that can be answered, and one of its fields changed.
fn changed(at: usize, bytes: &[u8]) -> Vec<u8> {
    let (_, _, mut body) = whole(&synthetic(5, 0, N, 100));
    body[at..at + bytes.len()].copy_from_slice(bytes);
    body
}

#[test]
fn what_cannot_be_answered_is_refused_with_its_reason() {
    let (world, mut memory) = (World::default(), Box::new(Room::new()));
    let mut server = world.server(&mut memory);
    // Two pinhole cameras of 17 bytes, then the flags, then the options.
    let nan = f32::NAN.to_le_bytes();
    let cases: [(u8, Vec<u8>, Reason); 11] = [
        (1, changed(1, &nan), Reason::Camera { which: 0 }),
        (1, changed(18, &(-1.0f32).to_le_bytes()), Reason::Camera { which: 1 }),
        (1, changed(35, &nan), Reason::Options(OptionsError::MaxError)),
        (1, changed(39, &(-1.0f32).to_le_bytes()), Reason::Options(OptionsError::Sigma)),
        (1, changed(43, &(1.0f32).to_le_bytes()), Reason::Options(OptionsError::Confidence)),
        (1, changed(51, &[0; 4]), Reason::Options(OptionsError::NoIterations)),
        (1, changed(81 + 16 * 3 + 8, &nan), Reason::Input(InputError::NotFinite { array: 1, index: 3 })),
        (3, vec![1], Reason::Length { given: 1 }),
        (1, vec![9; 30], Reason::Length { given: 30 }),
        (9, vec![], Reason::Kind { kind: 9 }),
        (0x81, vec![], Reason::Kind { kind: 0x81 }),
    ];
    for (k, (kind, body, reason)) in cases.iter().enumerate() {
        world.push(&by_hand(VERSION, *kind, k as u16, body));
        assert_eq!(world.run(&mut server), [Activity::Refused(*reason)]);
        let expected = Refusal { sequence: Some(k as u16), reason: *reason };
        world.replies(|_, reply, _| assert_eq!(*reply, Reply::Refused(expected, k as u32 + 1)));
    }
    // Too few and too many.
    let few = synthetic(5, 11, 4, 100);
    world.push(&few);
    let too_few = Reason::Input(InputError::TooFew { given: 4, needed: 5 });
    assert_eq!(world.run(&mut server), [Activity::Refused(too_few)]);
    let mut small_memory = Box::new(Memory::<8, { frame_bytes(8) }>::new());
    let mut small =
        Server::new(&mut small_memory, world.clone(), world.clone(), world.clone(), Limits::default());
    let ten = synthetic(5, 0, 10, 100);
    world.push(&ten);
    let too_many = Reason::Input(InputError::TooMany { given: 10, capacity: 8 });
    assert_eq!(small.poll(), Activity::Refused(too_many));
    assert_eq!(server.statistics().refused(), 12);
}

#[test]
fn a_frame_that_stops_is_given_up_in_time() {
    let (world, mut memory) = (World::default(), Box::new(Room::new()));
    let mut server = world.server(&mut memory);
    let sent = synthetic(1, 0, N, 100);
    world.push(&sent[..100]);
    world.input.borrow_mut().push_back(Event::Silence(99_000));
    world.push(&sent[100..200]);
    world.input.borrow_mut().push_back(Event::Silence(100_000));
    assert_eq!(world.run(&mut server), [Activity::Refused(Reason::Timeout)]);
    // What still comes of it belongs to it; the next frame is answered.
    world.push(&sent[200..]);
    world.push(&sent);
    assert_eq!(world.run(&mut server), [Activity::Answered]);
    // Silence between frames is none of the server's business.
    world.input.borrow_mut().push_back(Event::Silence(10_000_000));
    assert_eq!(world.run(&mut server), []);
    let statistics = server.statistics();
    assert_eq!((statistics.timeout, statistics.answered, statistics.refused()), (1, 1, 1));
    assert_eq!(statistics.uptime_ms, 10_199);
}

#[test]
fn lost_bytes_and_a_deaf_partner_are_counted_and_stop_nothing() {
    let (world, mut memory) = (World::default(), Box::new(Room::new()));
    let mut server = world.server(&mut memory);
    let sent = synthetic(1, 0, N, 100);
    world.push(&sent[..50]);
    world.input.borrow_mut().push_back(Event::Error);
    world.push(&sent[51..]);
    let activities = world.run(&mut server);
    assert!(matches!(activities[..], [Activity::Refused(_)]), "{activities:?}");
    world.deaf.set(true);
    world.push(&sent);
    assert_eq!(world.run(&mut server), [Activity::Answered]);
    world.deaf.set(false);
    world.output.borrow_mut().clear();
    world.push(&sent);
    assert_eq!(world.run(&mut server), [Activity::Answered]);
    let mut answers = 0;
    world.replies(|_, reply, _| {
        answers += 1;
        // The same number again.
        assert!(matches!(reply, Reply::RelativePose(answer) if answer.order == Order::Late));
    });
    assert_eq!(answers, 1);
    let statistics = server.statistics();
    assert_eq!((statistics.line_errors, statistics.output_errors, statistics.late), (1, 1, 1));
}

#[test]
fn the_pin_is_high_while_an_answer_waits() {
    let (world, mut memory) = (World::default(), Box::new(Room::new()));
    let states = [State::Low, State::High, State::Low, State::High, State::Low].map(Transaction::set);
    let mut pin = Pin::new(&states);
    let mut server = Server::new(&mut *memory, world.clone(), pin.clone(), world.clone(), Limits::default());
    world.push(&synthetic(1, 0, N, 100));
    world.push(&[5, 6, 7, 0]);
    assert_eq!(server.poll(), Activity::Answered);
    assert_eq!(server.poll(), Activity::Refused(Reason::Malformed));
    assert_eq!(server.poll(), Activity::Idle);
    pin.done();
}

#[test]
fn restart_and_statistics_tell_the_counters() {
    let (world, mut memory) = (World::default(), Box::new(Room::new()));
    let mut server = world.server(&mut memory);
    world.push(&by_hand(VERSION, kind::STATISTICS, 7, &[]));
    world.push(&by_hand(VERSION, kind::RESTART, 10, &[]));
    assert_eq!(world.run(&mut server), [Activity::Answered, Activity::Restart]);
    let mut told = Vec::new();
    world.replies(|frame, reply, _| {
        told.push((
            frame.sequence,
            match reply {
                Reply::Statistics(statistics) | Reply::Restart(statistics) => *statistics,
                other => panic!("{other:?}"),
            },
        ));
    });
    let sizes = Statistics { capacity: 100, wide_capacity: 24, frame_capacity: BYTES as u32, ..told[0].1 };
    assert_eq!((told[0].0, told[0].1), (7, sizes));
    assert_eq!((told[1].0, told[1].1.asked, told[1].1.missed), (10, 2, 2));
}

/// The stream of the decoder's test, through the whole server: every frame is answered or refused, in order, exactly once.
#[test]
fn of_a_hundred_thousand_frames_none_is_lost() {
    const FRAMES: usize = 100_000;
    let (world, mut memory) = (World::default(), Box::new(Room::new()));
    let mut server = world.server(&mut memory);
    let mut random = SplitMix64(3);
    // Damaged options may ask for any number of iterations: the limit ends them.
    world.step_us.set(300_000);
    let (mut whole_frames, mut accepted, mut replies, mut estimates) = (0u32, 0u32, 0u32, 0u32);
    // Requests with few iterations: it is the frames that are tested here.
    let requests: Vec<_> = (0..50).map(|k| whole(&synthetic(k, 0, 12, 1))).collect();
    let mut line = Vec::new();
    for batch in 0..FRAMES / 100 {
        line.clear();
        for k in 0..100 {
            let sequence = (batch * 100 + k) as u16;
            let (kind, mut body) = match below(&mut random, 8) {
                0 => (kind::STATISTICS, vec![]),
                1 => (
                    below(&mut random, 256) as u8,
                    (0..below(&mut random, 90)).map(|_| random.bits() as u8).collect(),
                ),
                _ => {
                    let (kind, _, body) = &requests[below(&mut random, requests.len())];
                    (*kind, body.clone())
                }
            };
            // Whole frames with any content, too.
            if below(&mut random, 10) == 0 && !body.is_empty() {
                let at = below(&mut random, body.len());
                match random.bits() & 3 {
                    0 => body[at] = random.bits() as u8,
                    1 => body.truncate(at),
                    _ => body.iter_mut().skip(at).take(8).for_each(|byte| *byte = 0xff),
                }
            }
            let damage = Damage::any(&mut random);
            whole_frames += u32::from(damage == Damage::None);
            line.extend(send(&mut random, damage, kind, sequence, body, BYTES).bytes);
        }
        line.push(0);
        let expected: Vec<Outcome> =
            line.split(|&b| b == 0).filter(|c| !c.is_empty()).map(|c| reference(c, BYTES)).collect();
        world.push(&line);
        let activities = world.run(&mut server);
        assert_eq!(activities.len(), expected.len());
        let mut outcomes = expected.iter();
        world.replies(|frame, reply, _| {
            replies += 1;
            match (outcomes.next().expect("no more replies than frames"), reply) {
                (Err((sequence, reason)), Reply::Refused(refusal, count)) => {
                    assert_eq!((refusal.sequence, refusal.reason), (*sequence, *reason));
                    assert_eq!(*count + accepted, replies);
                }
                (Ok((kind, sequence, body)), reply) => {
                    assert_eq!(frame.sequence, *sequence);
                    let asked = Request::parse(&Frame { kind: *kind, sequence: *sequence, body });
                    let refused = matches!(reply, Reply::Refused(..));
                    assert!(asked.is_ok() || refused);
                    accepted += u32::from(!refused);
                    estimates += u32::from(frame.kind == 0x81 || frame.kind == 0x82);
                }
                other => panic!("{other:?}"),
            }
        });
        assert_eq!(outcomes.next(), None);
    }
    let statistics = server.statistics();
    assert!(whole_frames > 30_000 && estimates > 20_000, "{whole_frames} {estimates}");
    assert_eq!(statistics.answered, estimates);
    assert_eq!(statistics.answered + statistics.asked, accepted);
    assert_eq!(statistics.answered + statistics.asked + statistics.refused(), replies);
    for (name, count) in statistics.entries() {
        let rare = ["timeout", "late", "restarted", "interrupted", "line_errors", "output_errors"];
        assert!(
            count > 100 || name.contains("capacity") || name == "uptime_ms" || rare.contains(&name),
            "{name}"
        );
    }
    // High and low for every reply, and low at the start.
    assert_eq!(world.switches.get(), 2 * replies + 1);
}
