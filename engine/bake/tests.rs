//! A job of three stages in folders: stopped, damaged, spread and joined.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use super::*;
use crate::{Error, ErrorKind, Result, Stop};

fn id(stage: u32, index: u32) -> UnitId {
    UnitId { stage, index }
}

/// Seven units, seven that each need the one of their number, and two that need others.
fn job(seed: u32) -> Job {
    let stages = vec![
        Stage::new("first", vec![3, 1, 4, 1, 5, 9, 2]),
        Stage::new("second", vec![1; 7]).needs(0, Which::Same),
        Stage::new("sums", vec![1; 2]).needs(1, Which::All).needs(0, Which::Listed(vec![vec![1, 6], vec![]])),
    ];
    Job::new(Key::new("test", 1).text("seed", &seed.to_string()), stages).unwrap()
}

/// Mixes the unit's number with all bytes that it needs.
fn mix(unit: UnitId, needed: Needed<'_>) -> Result<Vec<u8>> {
    let mut out = vec![unit.stage as u8, unit.index as u8];
    for &need in needed.units() {
        let bytes = needed.open(need)?.bytes()?;
        out.extend_from_slice(&Digest::of(&bytes).0);
    }
    Ok(out)
}

fn shard(index: u64, count: u64) -> Options {
    Options { shard: Shard::of(index, count).unwrap(), ..Options::default() }
}

fn all(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut out: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    out.sort();
    out
}

fn whole(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let store = Store::create(folder, job(0)).unwrap();
    let outcome = run(&store, &Options::default(), mix, |_| {}).unwrap();
    assert_eq!((outcome.end, outcome.computed), (End::Done, 16));
    all(folder)
}

#[test]
fn any_number_of_shards_in_any_order_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let expected = whole(&at("whole"));
    assert_eq!(expected.len(), 17);
    for count in [1, 2, 3, 5, 40] {
        // In one folder, from the last to the first; stages wait until what they need is there.
        let together = at(&format!("together{count}"));
        let store = Store::create(&together, job(0)).unwrap();
        for _ in 0..3 {
            (0..count).rev().for_each(|i| drop(run(&store, &shard(i, count), mix, |_| {}).unwrap()));
        }
        assert!(all(&together) == expected, "{count}");
    }
}

#[test]
fn folders_of_machines_that_share_nothing_are_joined_stage_by_stage() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let expected = whole(&at("whole"));
    let apart: Vec<PathBuf> = (0..3).map(|i| at(&format!("apart{i}"))).collect();
    let mut missing = usize::MAX;
    for round in 0.. {
        for (i, own) in (0..).zip(&apart) {
            let store = Store::create(own, job(0)).unwrap();
            let outcome = run(&store, &shard(i, 3), mix, |_| {}).unwrap();
            let waits = matches!(&outcome.end, End::Waits(units) if !units.is_empty());
            assert!(waits || outcome.end == End::Done);
        }
        let (_, merged) = merge(&apart, &at("joined")).unwrap();
        assert!(merged.faulty.is_empty() && merged.missing.len() < missing && round < 3);
        missing = merged.missing.len();
        if missing == 0 {
            break;
        }
        // What one has found the others get.
        apart.iter().for_each(|own| drop(merge(&[at("joined")], own).unwrap()));
    }
    assert!(all(&at("joined")) == expected);
}

#[test]
fn what_is_there_is_not_computed_again_and_what_is_damaged_is() {
    let folder = tempfile::tempdir().unwrap();
    let expected = whole(folder.path());
    let store = Store::open(folder.path()).unwrap();
    let again = || run(&store, &Options::default(), mix, |_| {}).unwrap();
    assert_eq!(again().computed, 0);
    let path = |unit| store.path(unit);
    // Damaged, cut off, of another job, of another unit, empty, gone.
    let mut bytes = fs::read(path(id(0, 2))).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(path(id(0, 2)), &bytes).unwrap();
    fs::write(path(id(1, 0)), &fs::read(path(id(1, 0))).unwrap()[..99]).unwrap();
    fs::write(path(id(1, 1)), unit::encode(job(1).key().digest(), id(1, 1), b"x").unwrap()).unwrap();
    fs::copy(path(id(1, 3)), path(id(1, 2))).unwrap();
    fs::write(path(id(1, 5)), b"").unwrap();
    fs::remove_file(path(id(2, 1))).unwrap();
    fs::write(folder.path().join("notes.txt"), b"mine").unwrap();
    fs::write(folder.path().join(".lucerna-1-1.tmp"), b"of a process that was killed").unwrap();
    let survey = store.survey(true).unwrap();
    assert_eq!(survey.missing, [id(2, 1)]);
    let faulty: Vec<_> = survey.faulty.iter().map(|(unit, error)| (*unit, error.to_string())).collect();
    for ((unit, said), (expected, part)) in faulty.iter().zip([
        (id(0, 2), "first-000002.unit: is damaged"),
        (id(1, 0), "cut off"),
        (id(1, 1), "another job"),
        (id(1, 2), "is unit 3 of stage 1, not 2 of 1"),
        (id(1, 5), "is cut off: 0 bytes"),
    ]) {
        assert!(*unit == expected && said.contains(part), "{unit:?} {said}");
    }
    assert_eq!((faulty.len(), survey.whole.len(), survey.unknown), (5, 10, vec!["notes.txt".into()]));
    // A look at the headers alone does not see every damage.
    assert_eq!(store.survey(false).unwrap().faulty.len(), 4);
    assert_eq!(again().computed, 6);
    assert_eq!(fs::read(folder.path().join("notes.txt")).unwrap(), b"mine");
    fs::remove_file(folder.path().join("notes.txt")).unwrap();
    fs::remove_file(folder.path().join(".lucerna-1-1.tmp")).unwrap();
    assert!(all(folder.path()) == expected);
}

#[test]
fn a_description_that_is_damaged_is_written_anew_and_one_of_other_work_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let expected = whole(folder.path());
    let path = folder.path().join(MANIFEST);
    fs::write(&path, b"{}").unwrap();
    assert!(Store::open(folder.path()).unwrap_err().to_string().contains("job.json: is damaged"));
    Store::create(folder.path(), job(0)).unwrap();
    assert!(all(folder.path()) == expected);
    let error = Store::create(folder.path(), job(1)).unwrap_err();
    assert!(error.to_string().contains("job.json: belongs to other work: `seed` is `0` instead of `1`"), "{error}");
    assert!(error.exit_code() == 1 && all(folder.path()) == expected);
    let error = Store::open(&folder.path().join("none")).unwrap_err();
    assert!(error.exit_code() == 3 && error.to_string().contains("fiv precompute"), "{error}");
}

#[test]
fn what_it_is_done_with_is_removed_and_no_more() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("own");
    whole(&own);
    fs::write(own.join("notes.txt"), b"mine").unwrap();
    assert_eq!(Store::open(&own).unwrap().remove().unwrap(), ["notes.txt"]);
    assert_eq!(all(&own), [("notes.txt".to_owned(), b"mine".to_vec())]);
    fs::remove_file(own.join("notes.txt")).unwrap();
    whole(&own);
    assert!(Store::open(&own).unwrap().remove().unwrap().is_empty() && !own.exists());
}

#[test]
fn jobs_of_other_keys_are_not_joined() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    whole(&a);
    Store::create(&b, job(7)).unwrap();
    let into = folder.path().join("c");
    let error = merge(&[a.clone(), b.clone()], &into).unwrap_err();
    let said = error.to_string();
    assert!(error.exit_code() == 3 && said.contains("`seed` is `7` instead of `0`") && !into.exists(), "{said}");
    assert!(merge(&[a], &b).unwrap_err().to_string().contains("belongs to other work"));
    assert_eq!(merge(&[], &into).unwrap_err().exit_code(), 2);
    assert_eq!(merge(std::slice::from_ref(&into), &into).unwrap_err().exit_code(), 3);
}

#[test]
fn a_join_takes_the_good_file_and_names_the_bad_one() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b, c) = (folder.path().join("a"), folder.path().join("b"), folder.path().join("c"));
    let expected = whole(&a);
    whole(&b);
    let bad = Store::open(&a).unwrap().path(id(0, 4));
    let bytes = fs::read(&bad).unwrap();
    fs::write(&bad, &bytes[..bytes.len() - 1]).unwrap();
    fs::write(b.join("notes.txt"), b"mine").unwrap();
    let (_, merged) = merge(&[a.clone(), b.clone(), c.clone()][..2], &c).unwrap();
    assert_eq!((merged.faulty.len(), merged.linked + merged.copied, merged.there), (1, 16, 0));
    assert!(merged.faulty[0].to_string().contains("cut off") && merged.missing.is_empty());
    assert_eq!(merged.unknown, [(b.clone(), "notes.txt".into())]);
    assert!(all(&c) == expected);
    // Once more nothing is to be done; into one of the folders itself, what is damaged there is mended.
    let (_, merged) = merge(&[a.clone(), b], &a).unwrap();
    assert_eq!((merged.there, merged.linked, merged.copied, merged.faulty.len()), (15, 0, 1, 1));
    assert!(all(&a) == expected);
}

#[cfg(unix)]
#[test]
fn a_link_is_not_written_through() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("own");
    let store = Store::create(&own, job(0)).unwrap();
    let precious = folder.path().join("precious");
    fs::write(&precious, b"mine").unwrap();
    std::os::unix::fs::symlink(&precious, store.path(id(0, 0))).unwrap();
    let error = run(&store, &Options::default(), mix, |_| {}).unwrap_err();
    assert!(error.to_string().contains("first-000000.unit: is a link") && error.exit_code() == 1, "{error}");
    assert_eq!(fs::read(&precious).unwrap(), b"mine");
}

#[test]
fn asked_to_stop_it_keeps_what_is_done_and_drops_what_fails() {
    for fails in [None, Some(ErrorKind::Interrupted), Some(ErrorKind::DeviceLost)] {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(folder.path(), job(0)).unwrap();
        let options = Options::default();
        let asked = |unit: UnitId, needed: Needed<'_>| {
            if unit == id(0, 3) {
                options.stop.request();
                if let Some(kind) = fails {
                    return Err(Error::new(kind, "stopped"));
                }
            }
            mix(unit, needed)
        };
        let outcome = run(&store, &options, asked, |_| {}).unwrap();
        let done = if fails.is_some() { 3 } else { 4 };
        assert_eq!((outcome.end, outcome.computed), (End::Stopped, done));
        assert_eq!(store.survey(true).unwrap().whole.len() as u64, done);
        // Asked before it begins it does nothing.
        assert_eq!(run(&store, &options, mix, |_| {}).unwrap().computed, 0);
        assert_eq!(run(&store, &Options::default(), mix, |_| {}).unwrap().computed, 16 - done);
    }
    // What fails by itself fails.
    let folder = tempfile::tempdir().unwrap();
    let store = Store::create(folder.path(), job(0)).unwrap();
    let broken = |_: UnitId, _: Needed<'_>| Err(Error::new(ErrorKind::DeviceLost, "lost"));
    let error = run(&store, &Options::default(), broken, |_| {}).unwrap_err();
    assert!(error.exit_code() == 6 && error.to_string() == "first 0: lost", "{error}");
}

#[test]
fn no_unit_is_begun_that_would_not_be_done_in_time() {
    let folder = tempfile::tempdir().unwrap();
    let stages = vec![Stage::new("a", vec![1, 1, 1000])];
    let store = Store::create(folder.path(), Job::new(Key::new("slow", 1), stages).unwrap()).unwrap();
    let slow = |_: UnitId, _: Needed<'_>| {
        std::thread::sleep(Duration::from_millis(20));
        Ok(vec![1])
    };
    // The third takes 20 s at least, as the first ones say: there would be time for any that is no slower than they were.
    let limited = |limit| Options { time_limit: Some(limit), begun: Instant::now(), ..Options::default() };
    let outcome = run(&store, &limited(Duration::from_secs(15)), slow, |_| {}).unwrap();
    assert_eq!((outcome.end, outcome.computed), (End::TimeLimit, 2));
    // Nothing is known of the first unit of a run: it is begun if there is time at all.
    assert_eq!(run(&store, &limited(Duration::ZERO), slow, |_| {}).unwrap().computed, 0);
    assert_eq!(run(&store, &limited(Duration::from_secs(15)), slow, |_| {}).unwrap().end, End::Done);
}

#[test]
fn units_of_others_are_waited_for_as_long_as_asked() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::create(folder.path(), job(0)).unwrap();
    let mine = Options { wait: Duration::from_secs(60), ..shard(1, 2) };
    let (outcome, other) = std::thread::scope(|scope| {
        let waiting = scope.spawn(|| run(&store, &mine, mix, |_| {}).unwrap());
        std::thread::sleep(Duration::from_millis(50));
        // The first waits in vain where nobody asked it to wait, until the other has done its part.
        let mut other = run(&store, &shard(0, 2), mix, |_| {}).unwrap();
        while other.end != End::Done {
            other = run(&store, &shard(0, 2), mix, |_| {}).unwrap();
        }
        (waiting.join().unwrap(), other)
    });
    assert_eq!((outcome.end, other.end), (End::Done, End::Done));
    assert!(store.survey(true).unwrap().missing.is_empty());
    // Asked to stop while it waits, it stops.
    let folder = tempfile::tempdir().unwrap();
    let store = Store::create(folder.path(), job(0)).unwrap();
    let stop = Stop::default();
    let options = Options { wait: Duration::from_secs(60), stop: stop.clone(), ..shard(1, 2) };
    let told = |progress: &Progress| {
        if progress.units[0] >= 3 {
            stop.request();
        }
    };
    assert_eq!(run(&store, &options, mix, told).unwrap().end, End::Stopped);
}

#[test]
fn progress_counts_what_was_there_apart() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::create(folder.path(), job(0)).unwrap();
    run(&store, &shard(0, 2), mix, |_| {}).unwrap();
    let mut heard = Vec::new();
    run(&store, &Options::default(), mix, |progress| heard.push(*progress)).unwrap();
    let (first, last) = (heard[0], heard[heard.len() - 1]);
    assert_eq!((first.before, first.cost[1], first.seconds_left()), (first.cost[0], 34, None));
    assert!(first.before > 0 && last.units == [16, 16] && last.cost == [34, 34] && last.bytes > 0);
    assert_eq!(last.seconds_left(), Some(0.0));
    let halfway = Progress { cost: [30, 50], before: 10, seconds: 2.0, ..Progress::default() };
    assert_eq!((halfway.rate(), halfway.seconds_left()), (10.0, Some(2.0)));
}
