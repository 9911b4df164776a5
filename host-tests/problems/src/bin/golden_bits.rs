//! `golden_bits` compares this machine's answers with the committed hashes and prints the table; the exit code is 1
//! where a bit is wrong. `golden_bits --update` writes `host-tests/golden/bits.txt` instead: on purpose only, and with a
//! line in the changelog.

use std::process::ExitCode;

use epipole_problems::golden::{Answer, VERSIONS, run, run_any_bits};

fn main() -> ExitCode {
    let mut answers: Vec<Answer> = vec![];
    run(&mut |answer| answers.push(answer));
    run_any_bits(&mut |answer| answers.push(answer));
    let lines = answers.iter().map(|a| format!("{} {} {} {:016x}\n", a.kind, a.name, a.scalar, a.hash));
    if std::env::args().nth(1).as_deref() == Some("--update") {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../golden/bits.txt");
        std::fs::write(file, lines.collect::<String>()).expect("the table can be written");
        return ExitCode::SUCCESS;
    }
    lines.for_each(|line| print!("{line}"));
    let wrong: Vec<_> = answers.iter().filter(|a| !a.is_right()).collect();
    for a in &wrong {
        println!("WRONG: {} {} {}", a.kind, a.name, a.scalar);
    }
    println!("{VERSIONS}: {} of {} right", answers.len() - wrong.len(), answers.len());
    ExitCode::from(u8::from(!wrong.is_empty()))
}
