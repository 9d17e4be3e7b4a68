//! A file is what it was or complete, whatever happens while it is written.

use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use lucerna::{
    ErrorKind,
    image::{self, Format, Layers, WriteOptions},
};

const OVERWRITE: fn() -> WriteOptions = || WriteOptions { overwrite: true, f32: true, ..WriteOptions::default() };

/// A noisy picture, so that compression leaves hundreds of kilobytes.
fn picture(seed: u32) -> Layers {
    let mut state = seed;
    let data = (0..300 * 300 * 3).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32
    });
    Layers::rgb(300, 300, data.collect())
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// This test binary again, running only `child` with `target` to write.
fn spawn(target: &Path, shell: &str) -> Command {
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("{shell} exec \"$0\" child --exact --ignored --nocapture --test-threads 1")])
        .arg(std::env::current_exe().unwrap())
        .env("LUCERNA_TEST_TARGET", target)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Not a test of its own: writes one picture after the other until it is killed, or until the first error.
#[test]
#[ignore = "run by the other tests in a process of its own"]
fn child() {
    let Some(target) = std::env::var_os("LUCERNA_TEST_TARGET").map(PathBuf::from) else { return };
    // Encoded once: most of the time goes into writing, which is what is to be interrupted.
    let files = [1, 2].map(|seed| image::encode(Format::Exr, &picture(seed), &OVERWRITE()).unwrap().0);
    for i in 0..1_000_000 {
        println!("write {}", i % 2 + 1);
        if let Err(error) = image::write_atomic(&target, &files[i % 2], true) {
            println!("{:?}: {error}", error.kind());
            std::process::exit(1);
        }
    }
}

#[test]
fn a_killed_writer_leaves_the_old_or_the_new_file() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("frame.exr");
    let complete = [1, 2].map(|seed| image::encode(Format::Exr, &picture(seed), &OVERWRITE()).unwrap().0);
    fs::write(&target, &complete[0]).unwrap();
    let temporary = || names(folder.path()).iter().filter(|name| name.ends_with(".tmp")).count();
    let (mut unfinished, mut finished) = (0, 0);
    // The test must be able to fail: some are killed while they write, and some after they replaced the file. Which it was shows
    // afterwards, for between seeing a write and killing it the write goes on.
    for round in 0..500 {
        let before = temporary();
        let mut process = spawn(&target, "").stderr(Stdio::null()).spawn().unwrap();
        let mut lines = BufReader::new(process.stdout.take().unwrap()).lines().map(Result::unwrap);
        // The first file is complete, or both, when the next is begun.
        let event = format!("write {}", 2 - round % 2);
        assert!(lines.any(|line| line == event), "round {round}: it ended by itself");
        let begun = Instant::now();
        while temporary() == before && begun.elapsed() < Duration::from_secs(1) {
            std::hint::spin_loop();
        }
        process.kill().unwrap();
        process.wait().unwrap();
        let found = fs::read(&target).unwrap();
        assert!(complete.contains(&found), "round {round}: {} bytes are neither file", found.len());
        finished += u32::from(found == complete[1]);
        unfinished += temporary() - before;
        if round >= 7 && unfinished > 0 && finished > 0 {
            return;
        }
    }
    panic!("{unfinished} temporary files, {finished} replacements");
}

#[test]
fn a_full_disk_is_an_error_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("frame.exr");
    // No file may grow over 16 blocks; the signal for that is ignored, so that the write fails as on a full disk.
    let output = spawn(&target, "trap '' XFSZ; ulimit -f 16;").output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("Output: ") && said.contains("frame.exr: cannot write"), "{said}");
    assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));

    // With a file there already, that one stays.
    fs::write(&target, b"old").unwrap();
    spawn(&target, "trap '' XFSZ; ulimit -f 16;").output().unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["frame.exr"]);
}

#[cfg(target_os = "linux")]
#[test]
fn no_space_left_is_reported_with_its_cause() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("frame.png");
    std::os::unix::fs::symlink("/dev/full", &target).unwrap();
    let error = image::write(&target, &picture(1), &OVERWRITE()).unwrap_err();
    assert_eq!((error.kind(), error.exit_code()), (ErrorKind::Output, 1));
    assert!(error.to_string().contains("No space left on device"), "{error}");
}

#[test]
fn folders_that_are_missing_or_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("renders/frame.png");
    let error = image::write(&missing, &picture(1), &WriteOptions::default()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Output);
    assert!(error.to_string().contains("renders cannot be used") && error.to_string().contains("Create it"), "{error}");
    // Programs ask before they work, and the folder is made then.
    image::probe_output(&missing, false).unwrap();
    image::write(&missing, &picture(1), &WriteOptions::default()).unwrap();
    let under = missing.join("deep/frame.png");
    let error = image::probe_output(&under, false).unwrap_err();
    assert!(
        error.kind() == ErrorKind::Output && error.to_string().contains("frame.png/deep cannot be made"),
        "{error}"
    );

    // The target is a folder.
    fs::create_dir(folder.path().join("folder.png")).unwrap();
    let error = image::write(folder.path().join("folder.png"), &picture(1), &OVERWRITE()).unwrap_err();
    assert!(error.to_string().contains("is a folder"), "{error}");

    // A parent that is a file.
    fs::write(folder.path().join("file"), b"").unwrap();
    let error = image::write(folder.path().join("file/x.png"), &picture(1), &OVERWRITE()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Output);
}

/// /proc takes no new files from anyone, root included.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_takes_no_files_is_an_error() {
    let target = Path::new("/proc/frame.png");
    let error = image::write(target, &picture(1), &OVERWRITE()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Output);
    assert!(error.to_string().starts_with("/proc/frame.png: "), "{error}");
    assert!(image::probe_output(target, true).is_err());
}

#[cfg(unix)]
#[test]
fn a_read_only_folder_is_an_error() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(closed.join("probe"), b"").is_ok() {
        eprintln!("SKIPPED: permissions do not bind this user");
        return;
    }
    let error = image::write(closed.join("frame.png"), &picture(1), &OVERWRITE()).unwrap_err();
    assert!(error.to_string().contains("ermission denied"), "{error}");
}

#[test]
fn an_existing_file_is_kept_unless_overwriting_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("frame.pfm");
    image::write(&target, &picture(1), &WriteOptions::default()).unwrap();
    let first = fs::read(&target).unwrap();
    let error = image::write(&target, &picture(2), &WriteOptions::default()).unwrap_err();
    assert!(error.to_string().contains("exists already"), "{error}");
    assert_eq!(fs::read(&target).unwrap(), first);
    image::write(&target, &picture(2), &OVERWRITE()).unwrap();
    assert_ne!(fs::read(&target).unwrap(), first);
    assert_eq!(names(folder.path()), ["frame.pfm"]);
}

/// Files that belong together are all there, or none.
#[test]
fn files_that_belong_together_are_written_together() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (first, second, last) = (at("a"), at("b"), at("c"));
    let write = |second: &Path, overwrite: bool| {
        image::write_all_atomic(&[(&first, b"1"), (second, b"2"), (&last, b"3")], overwrite)
    };
    write(&second, false).unwrap();
    assert_eq!([&first, &second, &last].map(|path| fs::read(path).unwrap()), [b"1", b"2", b"3"]);

    // One is there already: what is new is not.
    for path in [&first, &last] {
        fs::remove_file(path).unwrap();
    }
    let error = write(&second, false).unwrap_err();
    assert!(error.to_string().contains("exists already"), "{error}");
    assert_eq!(names(folder.path()), ["b"]);
    // One cannot be written: what was there stays as it is.
    fs::write(&first, b"old").unwrap();
    fs::create_dir(at("folder")).unwrap();
    let error = write(&at("folder"), true).unwrap_err();
    assert!(error.to_string().contains("is a folder"), "{error}");
    assert_eq!(
        (names(folder.path()), fs::read(&first).unwrap()),
        (vec!["a".into(), "b".into(), "folder".into()], b"old".to_vec())
    );
    // None of them is longer than the disk, all together are.
    #[cfg(target_os = "linux")]
    {
        std::os::unix::fs::symlink("/dev/full", at("full")).unwrap();
        assert_eq!(write(&at("full"), true).unwrap_err().kind(), ErrorKind::Output);
        assert_eq!((names(folder.path()).len(), fs::read(&first).unwrap()), (4, b"old".to_vec()));
    }
}

/// Not a test of its own: leaves the process while other threads write.
#[test]
#[ignore = "run by the other tests in a process of its own"]
fn leaver() {
    let Some(target) = std::env::var_os("LUCERNA_TEST_TARGET").map(PathBuf::from) else { return };
    let bytes = vec![7u8; 1 << 22];
    for thread in 0..4 {
        let (path, bytes) = (target.with_extension(thread.to_string()), bytes.clone());
        std::thread::spawn(move || {
            loop {
                image::write_atomic(&path, &bytes, true).unwrap();
            }
        });
    }
    let folder = target.parent().unwrap();
    while !names(folder).iter().any(|name| name.ends_with(".tmp")) {
        std::thread::yield_now();
    }
    image::leave_nothing_unfinished();
    std::process::exit(0);
}

#[test]
fn a_process_that_leaves_leaves_no_temporary_file() {
    for _ in 0..5 {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["leaver", "--exact", "--ignored", "--test-threads", "1"]);
        let left = command.env("LUCERNA_TEST_TARGET", folder.path().join("x")).output().unwrap();
        assert!(left.status.success(), "{}", String::from_utf8_lossy(&left.stderr));
        for name in names(folder.path()) {
            assert!(!name.ends_with(".tmp"), "{name}");
            assert_eq!(fs::read(folder.path().join(name)).unwrap().len(), 1 << 22);
        }
    }
}
