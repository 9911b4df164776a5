//! Line coverage of every public function of the kernel, from an lcov file: a table, and a failure for a function that
//! no test enters or that tests run less than half of.
//!
//! `cargo run -p epipole-host-tests --bin public_coverage -- lcov.info`

use std::collections::HashMap;
use std::fs;
use std::process::ExitCode;

use epipole_host_tests::source::{flatten, kernel_source, public_functions, read_folder};

/// The share of its lines that tests must run: the rest is left to outcomes that only broken hardware or memory shows.
const NEEDED: f64 = 0.5;

/// How often each line of each file ran.
fn line_counts(lcov: &str) -> HashMap<String, HashMap<usize, u64>> {
    let mut files: HashMap<String, HashMap<usize, u64>> = HashMap::new();
    let mut file = String::new();
    for record in lcov.lines() {
        if let Some(path) = record.strip_prefix("SF:") {
            file = path.replace('\\', "/");
        } else if let Some((line, count)) = record.strip_prefix("DA:").and_then(|rest| rest.split_once(','))
            && let (Ok(line), Ok(count)) = (line.parse(), count.parse::<u64>())
        {
            *files.entry(file.clone()).or_default().entry(line).or_default() += count;
        }
    }
    files
}

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: public_coverage LCOV_FILE");
        return ExitCode::FAILURE;
    };
    let lcov = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) => {
            eprintln!("{path}: {error}");
            return ExitCode::FAILURE;
        }
    };
    let counts = line_counts(&lcov);
    let (mut functions, mut lines, mut run_lines) = (0, 0, 0);
    let mut poor = Vec::new();
    for file in read_folder(&kernel_source()) {
        let suffix = format!("kernel/src/{}", file.name);
        let counts = counts.iter().find(|(name, _)| name.ends_with(&suffix)).map(|(_, counts)| counts);
        for function in public_functions(&flatten(&file)) {
            let body: Vec<u64> = function
                .body
                .clone()
                .filter_map(|line| counts.and_then(|counts| counts.get(&line).copied()))
                .collect();
            let run = body.iter().filter(|&&count| count > 0).count();
            functions += 1;
            lines += body.len();
            run_lines += run;
            // A function of a macro has its lines where the macro is called.
            let share =
                if body.is_empty() && counts.is_some() { 1.0 } else { run as f64 / body.len() as f64 };
            if share < 1.0 {
                println!("{:5.1} %  {suffix}:{} {}", 100.0 * share, function.body.start(), function.name);
            }
            // Equal getters are merged into one by the optimiser, and only one of them is counted: shown, no failure.
            if !(share >= NEEDED) && body.len() > 3 {
                poor.push(format!("{suffix}:{} {}", function.body.start(), function.name));
            }
        }
    }
    println!("{functions} public functions, {run_lines} of their {lines} lines run by tests");
    if lines == 0 {
        eprintln!("the lcov file knows none of them");
        return ExitCode::FAILURE;
    }
    if !poor.is_empty() {
        eprintln!("public functions that tests run less than half of:\n{}", poor.join("\n"));
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
