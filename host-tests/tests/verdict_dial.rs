//! The verdict against a dial, as a committed table. `EPIPOLE_UPDATE_GOLDEN=1` writes it anew, on purpose.

use epipole_host_tests::dial::{Dial, PROBLEMS, table};

#[test]
fn golden_table_of_the_dials() {
    let table = table(|| {});
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/verdict_dial.txt");
    if std::env::var_os("EPIPOLE_UPDATE_GOLDEN").is_some() {
        std::fs::write(path, &table).unwrap();
    }
    let golden = std::fs::read_to_string(path).expect("the golden table is committed");
    assert_eq!(table, golden, "verdicts changed; EPIPOLE_UPDATE_GOLDEN=1 accepts it");
}

/// Whatever the table says: nine in ten are told at the degenerate end, and are right at the other.
#[test]
fn both_ends_of_every_dial_are_right() {
    for (dial, degenerate) in [(Dial::Baseline, 3), (Dial::PlaneThickness, 2), (Dial::LineThickness, 4)] {
        let positions = dial.positions();
        let first = dial.counts(positions[0]);
        assert!(u64::from(first[degenerate]) * 10 >= PROBLEMS * 9, "{dial:?}: {first:?}");
        let last = dial.counts(positions[8]);
        assert!(u64::from(last[1]) * 10 >= PROBLEMS * 9, "{dial:?}: {last:?}");
    }
}
