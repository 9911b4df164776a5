//! `budget FILE < JSON`: compares the instruction counts that the bench `instructions` printed as JSON with the
//! committed ones, a call each. More than 3 % above is a failure; `EPIPOLE_UPDATE_GOLDEN=1` writes the file anew.
//!
//! Counts belong to a compiler: with another one than the file names, they are shown and not judged (exit code 3). A
//! case that the file does not hold, or that was not measured, is a failure under any compiler.

use std::collections::BTreeMap;
use std::process::{Command, ExitCode};
use std::{env, fs, io};

use epipole_bench::cases;
use serde_json::Value;

/// How far above the budget a count may be.
const TOLERANCE: f64 = 0.03;
const NOT_JUDGED: u8 = 3;

/// Instructions a call, by the case's place in `cases()`.
fn measured(json: impl io::BufRead) -> Result<BTreeMap<usize, f64>, String> {
    let all = cases();
    let mut counts = BTreeMap::new();
    for line in json.lines() {
        let line = line.map_err(|e| e.to_string())?;
        let Ok(summary) = serde_json::from_str::<Value>(&line) else { continue };
        let place = summary["id"].as_str().and_then(|id| id.strip_prefix("all_")?.parse::<usize>().ok());
        let count = summary["profiles"][0]["data"]["total"]["metrics"]["Ir"]["values"]["new"].as_u64();
        let (Some(place), Some(count)) = (place, count) else {
            return Err(format!("no count in: {line}"));
        };
        let case = all.get(place).ok_or_else(|| format!("no case of number {place}"))?;
        counts.insert(place, count as f64 / (case.prepare)().calls as f64);
    }
    if counts.len() == all.len() {
        Ok(counts)
    } else {
        Err(format!("{} of {} cases", counts.len(), all.len()))
    }
}

fn compiler() -> String {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(rustc).arg("--version").output();
    version.map(|out| String::from_utf8_lossy(&out.stdout).trim().into()).unwrap_or_default()
}

fn compare(path: &str) -> Result<ExitCode, String> {
    let counts = measured(io::stdin().lock())?;
    let rows = cases().into_iter().zip(counts.into_values());
    if env::var_os("EPIPOLE_UPDATE_GOLDEN").is_some() {
        let mut text = format!(
            "# Instructions a call by callgrind, x86-64 without AVX; `.ci/run budget` compares, more than 3 % above fails\n\
             # compiler {}\n",
            compiler()
        );
        for (case, count) in rows {
            text += &format!("{} {} {count:.0}\n", case.name, case.scalar);
        }
        return fs::write(path, text).map(|()| ExitCode::SUCCESS).map_err(|e| format!("{path}: {e}"));
    }

    let text = fs::read_to_string(path).map_err(|e| format!("{path}: {e}"))?;
    let recorded = text.lines().find_map(|line| line.strip_prefix("# compiler ")).unwrap_or_default();
    let mut budget: BTreeMap<(&str, &str), f64> = BTreeMap::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let row: Vec<&str> = line.split_whitespace().collect();
        let [name, scalar, count] = row[..] else { return Err(format!("{path}: `{line}`")) };
        budget.insert((name, scalar), count.parse().map_err(|_| format!("{path}: `{line}`"))?);
    }

    let (mut above, mut below, mut missing) = (0, 0, 0);
    println!("{:42} {:>12} {:>12} {:>8}", "instructions a call", "budget", "now", "change");
    for (case, count) in rows {
        let name = format!("{} {}", case.name, case.scalar);
        let Some(allowed) = budget.remove(&(case.name, case.scalar)) else {
            println!("{name:42} {:>12} {count:12.0}  is not in {path}", "");
            missing += 1;
            continue;
        };
        let change = count / allowed - 1.0;
        let remark = match change {
            c if c > TOLERANCE => "ABOVE",
            c if c < -TOLERANCE => "below: a new budget would keep it",
            _ => "",
        };
        above += usize::from(change > TOLERANCE);
        below += usize::from(change < -TOLERANCE);
        println!("{name:42} {allowed:12.0} {count:12.0} {:+7.2}% {remark}", 100.0 * change);
    }
    for (name, scalar) in budget.keys() {
        println!("{name} {scalar} is in {path} and was not measured");
    }
    missing += budget.len();

    println!("{above} above the budget, {below} well below, {missing} missing");
    let now = compiler();
    if missing == 0 && now != recorded {
        println!("the budget was recorded with `{recorded}`, this is `{now}`: shown, not judged");
        return Ok(ExitCode::from(NOT_JUDGED));
    }
    if above + missing > 0 {
        println!("if that is on purpose: EPIPOLE_UPDATE_GOLDEN=1 .ci/run budget");
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

fn main() -> ExitCode {
    let Some(path) = env::args().nth(1) else {
        eprintln!("budget FILE < JSON");
        return ExitCode::from(2);
    };
    compare(&path).unwrap_or_else(|problem| {
        eprintln!("{problem}");
        ExitCode::from(2)
    })
}
