//! Runs the image `pose_server` in QEMU, streams correspondences and damaged frames over its emulated UART, and compares
//! every answer bit by bit with the library's here, and every refusal with what the format demands.
//!
//! The exit code is 0 where every frame was answered as it should and the server's counters agree.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode};
use std::time::{Duration, Instant};
use std::{env, thread};

use epipole_client::answers::{CAPACITY, Library};
use epipole_client::damage::{Damage, Outcome, below, by_hand, reference, send};
use epipole_client::files;
use epipole_client::problems::synthetic;
use epipole_problems::random::SplitMix64;
use epipole_wire::{
    Decoder, Frame, Reason, Reply, Request, Statistics, VERSION, encoded_len, kind, reply_bytes,
};

const USAGE: &str = "\
pose_client [--frames N] [--problems N] [--seed N] IMAGE [FILE...]
  IMAGE         the image pose_server, started by `runner` beside the images' Cargo.toml, or by RUNNER
  FILE...       real correspondences; the built-in scenes come in any case
  --frames N    frames that are damaged in one way or another (default 2000)
  --problems N  scenes (default 200)
  --seed N      of the damage (default 1)";

struct Arguments {
    frames: usize,
    problems: u32,
    seed: u64,
    image: PathBuf,
    files: Vec<PathBuf>,
}

fn arguments() -> Result<Arguments, Box<dyn Error>> {
    use lexopt::prelude::*;
    let (mut frames, mut problems, mut seed, mut paths) = (2000, 200, 1, Vec::new());
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("frames") => frames = parser.value()?.parse()?,
            Long("problems") => problems = parser.value()?.parse()?,
            Long("seed") => seed = parser.value()?.parse()?,
            Value(path) => paths.push(PathBuf::from(path)),
            other => return Err(other.unexpected().into()),
        }
    }
    let image = if paths.is_empty() { return Err("no image".into()) } else { paths.remove(0) };
    Ok(Arguments { frames, problems, seed, image, files: paths })
}

fn main() -> ExitCode {
    let arguments = match arguments() {
        Ok(arguments) => arguments,
        Err(reason) => {
            eprintln!("{reason}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("FAILED: {reason}");
            ExitCode::FAILURE
        }
    }
}

/// The emulator behind its runner; it ends with us.
struct Machine(Child);

impl Drop for Machine {
    fn drop(&mut self) {
        if matches!(self.0.try_wait(), Ok(None)) {
            // The runner and all that it started, for none outlives it then.
            let group = format!("kill -s TERM -- -{}", self.0.id());
            let _ = Command::new("sh").args(["-c", &group]).status();
        }
        let _ = self.0.wait();
    }
}

fn start(image: &Path) -> Result<(Machine, TcpStream), Box<dyn Error>> {
    let runner = env::var_os("RUNNER")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../runner")), PathBuf::from);
    // A free port of this machine alone: no file, whose path could be too long or be left behind.
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    listener.set_nonblocking(true)?;
    let child = Command::new(runner)
        .arg(image)
        .env("QEMU_ARGS", format!("-serial tcp:{}", listener.local_addr()?))
        .env("TIMEOUT", env::var("TIMEOUT").unwrap_or_else(|_| "1800".into()))
        .process_group(0)
        .spawn()?;
    let mut machine = Machine(child);
    let begun = Instant::now();
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(Duration::from_secs(300)))?;
                return Ok((machine, stream));
            }
            Err(_) if machine.0.try_wait()?.is_some() => return Err("the image did not start".into()),
            Err(_) if begun.elapsed() > Duration::from_secs(120) => return Err("no emulator came".into()),
            Err(_) => thread::sleep(Duration::from_millis(20)),
        }
    }
}

/// Calls `each` with every frame that comes, until it has enough.
fn receive(
    stream: &mut TcpStream,
    mut each: impl FnMut(&Frame<'_>, &[u8]) -> Result<bool, Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let mut buffer = vec![0; encoded_len(reply_bytes(CAPACITY))];
    let mut decoder = Decoder::new(&mut buffer);
    let mut bytes = Vec::new();
    let mut chunk = [0; 4096];
    loop {
        let count = stream.read(&mut chunk)?;
        if count == 0 {
            return Err("the line was closed".into());
        }
        for &byte in &chunk[..count] {
            bytes.push(byte);
            if let Some(frame) = decoder.feed(byte) {
                let frame = frame.map_err(|refusal| format!("an answer is damaged: {}", refusal.reason))?;
                if !each(&frame, &bytes)? {
                    return Ok(());
                }
                bytes.clear();
            }
        }
    }
}

fn ask(stream: &mut TcpStream, kind: u8, sequence: u16) -> Result<Statistics, Box<dyn Error>> {
    stream.write_all(&by_hand(VERSION, kind, sequence, &[]))?;
    let mut told = None;
    receive(stream, |frame, _| match Reply::parse(frame) {
        Some(Reply::Statistics(statistics) | Reply::Restart(statistics)) => {
            told = Some(statistics);
            Ok(false)
        }
        other => Err(format!("counters were asked for: {other:?}").into()),
    })?;
    told.ok_or_else(|| "no counters".into())
}

/// A row of the table.
#[derive(Default)]
struct Row {
    frames: u32,
    correspondences: usize,
    inliers: u32,
    elapsed_us: u64,
    longest_us: u32,
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let begun = Instant::now();
    let (mut machine, mut stream) = start(&arguments.image)?;
    let before = ask(&mut stream, kind::STATISTICS, 0)?;
    let (most, capacity) = (before.capacity as usize, before.frame_capacity as usize);

    // Everything that is sent, in one line; what stands between two delimiters is a frame.
    let mut sequence = 0u16;
    let mut next = || {
        sequence = sequence.wrapping_add(1);
        sequence
    };
    let mut random = SplitMix64(arguments.seed);
    let mut truths = BTreeMap::new();
    let mut line = Vec::new();
    for path in &arguments.files {
        let number = next();
        let real = files::read(path, number, most).map_err(|e| format!("{}: {e}", path.display()))?;
        line.extend(&real.bytes);
        truths.insert(number, (path.display().to_string(), real.rotation));
    }
    let problems = u64::from(arguments.problems);
    let mut asked = 0;
    let mut whole = arguments.files.len();
    for k in 0..arguments.frames.max(arguments.problems as usize) {
        // The scenes evenly among the damaged frames.
        while asked < arguments.problems && u64::from(asked) * arguments.frames as u64 <= k as u64 * problems
        {
            line.extend(synthetic(asked, next(), most, 1000));
            (asked, whole) = (asked + 1, whole + 1);
        }
        if k < arguments.frames {
            let small = synthetic(below(&mut random, 1000) as u32, 0, 8 + below(&mut random, 8), 4);
            let (kind, _, body) = reference(&small[1..small.len() - 1], capacity).expect("a whole frame");
            let (kind, body) = match below(&mut random, 6) {
                0 => (kind::STATISTICS, vec![]),
                1 => (5 + below(&mut random, 90) as u8, body),
                2 => (kind, body[..below(&mut random, body.len())].to_vec()),
                _ => (kind, body),
            };
            let damage = match Damage::any(&mut random) {
                // Long enough to show, rarely, for it takes its time on the line.
                Damage::TooLong if below(&mut random, 4) > 0 => Damage::Cut,
                damage => damage,
            };
            let sent = send(&mut random, damage, kind, next(), body, capacity);
            line.extend(sent.bytes);
        }
    }
    line.push(0);
    let expected: Vec<Outcome> =
        line.split(|&b| b == 0).filter(|c| !c.is_empty()).map(|c| reference(c, capacity)).collect();

    let sent_bytes = line.len();
    let mut sender = stream.try_clone()?;
    let sending = thread::spawn(move || sender.write_all(&line));

    let mut library = Library::default();
    let mut rows: BTreeMap<String, Row> = BTreeMap::new();
    let mut at = 0;
    let (mut estimates, mut answered, mut equal) = (0, 0, 0);
    receive(&mut stream, |frame, bytes| {
        let outcome = expected.get(at).ok_or("more answers than frames")?;
        let reply = Reply::parse(frame).ok_or("an answer that cannot be read")?;
        let right = match (outcome, &reply) {
            (Err((sequence, reason)), Reply::Refused(refusal, _)) => {
                (refusal.sequence, refusal.reason) == (*sequence, *reason)
            }
            (Ok((kind, sequence, body)), reply) => {
                let request = Frame { kind: *kind, sequence: *sequence, body };
                match (Request::parse(&request), reply) {
                    (Err(reason), Reply::Refused(refusal, _)) => {
                        (refusal.sequence, refusal.reason) == (Some(*sequence), reason)
                    }
                    (Ok(Request::Statistics), Reply::Statistics(_)) => frame.sequence == *sequence,
                    (Ok(_), Reply::Refused(refusal, _)) => {
                        refusal.sequence == Some(*sequence)
                            && matches!(refusal.reason, Reason::Input(_) | Reason::Options(_) | Reason::Prior)
                            && library.refuses(&request)
                    }
                    (Ok(_), reply) => {
                        let same = library.expected(&request, reply).as_deref() == Some(bytes);
                        estimates += 1;
                        equal += u32::from(same);
                        tell(reply, &request, &truths, &mut rows);
                        same
                    }
                    _ => false,
                }
            }
            _ => false,
        };
        answered += u32::from(!matches!(reply, Reply::Refused(..)));
        if !right {
            return Err(format!("frame {at}, {outcome:?}, was answered by {reply:?}").into());
        }
        at += 1;
        Ok(at < expected.len())
    })?;
    sending.join().map_err(|_| "the sender failed")??;

    let last = next();
    let after = ask(&mut stream, kind::RESTART, last)?;
    let code = machine.0.wait()?;
    println!(
        "{:44} {:>6} {:>8} {:>8} {:>11} {:>11}",
        "answered", "frames", "matches", "inliers", "mean us", "longest us"
    );
    for (name, row) in &rows {
        let n = row.frames.max(1);
        println!(
            "{name:44} {:>6} {:>8} {:>8} {:>11} {:>11}",
            row.frames,
            row.correspondences / n as usize,
            row.inliers / n,
            row.elapsed_us / u64::from(n),
            row.longest_us
        );
    }
    println!("\nthe server's counters");
    for (name, count) in after.entries().filter(|(_, count)| *count > 0) {
        println!("{name:20} {count:>9}");
    }
    println!(
        "\n{} frames of {} bytes: {whole} requests sent whole among {} others; {} refused with the right reason; \
         {equal} of {estimates} estimates with the host's bits; {:.1} s",
        expected.len(),
        sent_bytes,
        arguments.frames,
        after.refused(),
        begun.elapsed().as_secs_f64()
    );
    // Since the first counters: a byte that came before the image's UART was ready is none of the server's.
    let arrived = after.bytes.wrapping_sub(before.bytes) as usize;
    let own = by_hand(VERSION, kind::RESTART, last, &[]).len();
    let checks = [
        ("every byte arrived", arrived == sent_bytes + own),
        ("every frame was answered", at == expected.len()),
        ("every estimate is counted", after.answered == estimates),
        ("every answer is counted", after.answered + after.asked == answered + 2),
        ("every refusal is counted", (after.refused() + answered) as usize == expected.len()),
        ("no byte was lost", after.line_errors == 0 && after.output_errors == 0),
        ("requests sent whole have estimates", estimates as usize >= whole),
        ("the image ended well", code.success()),
    ];
    match checks.iter().find(|(_, holds)| !holds) {
        Some((check, _)) => Err(format!("{check}: no ({code})").into()),
        None => Ok(()),
    }
}

/// Adds an estimate to the table.
fn tell(
    reply: &Reply<'_>,
    request: &Frame<'_>,
    truths: &BTreeMap<u16, (String, epipole::nalgebra::Matrix3<f64>)>,
    rows: &mut BTreeMap<String, Row>,
) {
    let (what, verdict, pose, report, elapsed_us, count) = match reply {
        Reply::RelativePose(a) => (
            "relative",
            format!("{:?}", a.estimate.verdict),
            a.estimate.pose(),
            a.estimate.report,
            a.elapsed_us,
            a.inliers.iter().count(),
        ),
        Reply::AbsolutePose(a) => (
            "absolute",
            format!("{:?}", a.estimate.verdict),
            a.estimate.pose(),
            a.estimate.report,
            a.elapsed_us,
            a.inliers.iter().count(),
        ),
        _ => return,
    };
    let verdict: String = verdict.chars().take_while(|c| !"({[".contains(*c)).collect();
    let name = match truths.get(&request.sequence) {
        Some((path, truth)) => {
            let error = pose.map(|pose| {
                let r = pose.rotation.to_rotation_matrix().into_inner().map(f64::from);
                (2.0 * ((r - truth).norm() / 8.0f64.sqrt()).min(1.0).asin()).to_degrees()
            });
            let file = path.rsplit('/').next().unwrap_or_default();
            format!("{file} {verdict} {:.3} deg", error.unwrap_or(f64::NAN))
        }
        None => format!("{what} {verdict}, {:?}", report.stop),
    };
    let row = rows.entry(name).or_default();
    row.frames += 1;
    row.correspondences += count;
    row.inliers += report.inliers;
    row.elapsed_us += u64::from(elapsed_us);
    row.longest_us = row.longest_us.max(elapsed_us);
}
