//! The viewer under an X server without a screen: what the window shows is what `render` writes, keys and mouse do what the page of keys says, and it
//! ends when it is closed.
#![cfg(unix)]

#[path = "../../window/tests/window/desktop.rs"]
mod desktop;
mod support;
mod window;

use std::time::Duration;

use support::{command, lucerna};
use window::*;

#[test]
fn the_window_shows_what_render_writes_and_keys_change_it() {
    let Some(server) = ready() else { return };
    let of = "render isr --builtin cornell --camera 0";
    let whole = by_command(of);
    let viewer = Viewer::bare(&server, "--technique isr --builtin cornell");
    viewer.shows("the picture of render", &whole);

    // F5: direct light.
    viewer.desktop.hit(F1 + 4);
    let direct = by_command(&format!("{of} --mode direct"));
    assert_ne!(direct, whole);
    viewer.shows("direct light", &direct);
    // F2: with exponential shadow maps.
    viewer.desktop.hit(F1 + 1);
    viewer.shows("exponential shadow maps", &by_command(&format!("{of} -D shadow.kind=exponential")));
    viewer.desktop.hit(F1 + 2);
    viewer.shows("isr again", &whole);

    // At rest it draws nothing and computes nothing.
    std::thread::sleep(Duration::from_secs(1));
    let before = viewer.processor_seconds();
    std::thread::sleep(Duration::from_secs(3));
    let used = viewer.processor_seconds() - before;
    assert!(used < 0.3, "{used} s of processor time in 3 s at rest");

    // Panels come and go, and keys still work.
    viewer.desktop.hit(TAB);
    viewer.until("the panels", |picture| picture != whole);
    viewer.desktop.hit(TAB);
    viewer.shows("no panels", &whole);

    // False colour, and back.
    viewer.desktop.hit(letter('x'));
    viewer.until("false colour", |picture| picture != whole);
    viewer.desktop.hit(letter('x'));
    viewer.shows("light again", &whole);

    // Half a stop darker than the exposure of the built-in scene; 0 brings it back.
    viewer.desktop.hit(letter('-'));
    viewer.shows("a darker picture", &by_command(&format!("{of} --exposure 1.5")));
    viewer.desktop.hit(letter('0'));
    viewer.shows("the exposure of the scene", &whole);

    // The page of keys covers the picture; Escape closes it.
    viewer.desktop.hit(F1);
    viewer.until("the page of keys", |picture| picture != whole);
    viewer.desktop.hit(ESCAPE);
    viewer.shows("the picture without the page", &whole);
    viewer.close();
}

#[test]
fn the_camera_moves_and_comes_back_and_files_are_what_the_window_shows() {
    let Some(server) = ready() else { return };
    let of = "render isr --builtin cornell --camera 0";
    let whole = by_command(of);
    let viewer = Viewer::bare(&server, "--technique isr --builtin cornell");
    viewer.shows("the picture of render", &whole);

    // P writes it, with the metadata of render.
    viewer.desktop.hit(letter('p'));
    let file = written(viewer.folder.path(), ".png");
    assert_eq!(codes(&file), whole);
    let again = lucerna(["rerun".as_ref(), file.as_os_str()]);
    again.expect(0, &[]);

    // Flying.
    viewer.desktop.key(letter('w'), true);
    std::thread::sleep(Duration::from_millis(300));
    viewer.desktop.key(letter('w'), false);
    let lit = |picture: &[[u8; 3]]| picture.iter().filter(|pixel| pixel[0] > 60).count() > 2000;
    viewer.until("another place", |picture| picture != whole && lit(picture));
    viewer.desktop.hit(letter('r'));
    viewer.shows("the scene's camera", &whole);

    // Looking around, below the lamp, which would move instead.
    viewer.desktop.point(40, 80);
    viewer.desktop.button(1, true);
    for step in 1..=10 {
        viewer.desktop.point(40 + 2 * step, 80);
        std::thread::sleep(Duration::from_millis(20));
    }
    viewer.desktop.button(1, false);
    viewer.until("another direction", |picture| picture != whole && lit(picture));
    std::fs::remove_file(&file).unwrap();
    // The file of the moved camera is the picture that rests. The first request may come while the one before ends.
    let moved = loop {
        viewer.desktop.hit(letter('p'));
        std::thread::sleep(Duration::from_millis(300));
        if std::fs::read_dir(viewer.folder.path()).unwrap().next().is_some() {
            break codes(&written(viewer.folder.path(), ".png"));
        }
    };
    assert_ne!(moved, whole);
    viewer.shows("the picture of the file", &moved);
    viewer.desktop.hit(letter('r'));
    viewer.shows("the scene's camera again", &whole);
    viewer.close();
}

#[test]
fn a_flight_through_kept_cameras_ends_at_the_last() {
    let Some(server) = ready() else { return };
    let viewer = Viewer::bare(&server, "--technique isr --builtin cornell");
    let first = by_command("render isr --builtin cornell --camera 0");
    viewer.shows("the scene's camera", &first);
    // One camera is no flight.
    viewer.desktop.hit(letter('k'));
    viewer.desktop.hit(letter('g'));
    viewer.desktop.key(letter('w'), true);
    std::thread::sleep(Duration::from_millis(300));
    viewer.desktop.key(letter('w'), false);
    viewer.desktop.hit(letter('k'));
    // Mean difference of the codes. The smooth picture comes later than the sharp one, and differs at edges alone.
    let apart = |a: &[[u8; 3]], b: &[[u8; 3]]| {
        let codes = a.as_flattened().iter().zip(b.as_flattened());
        codes.map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.as_flattened().len() as f64
    };
    let mut last = viewer.picture();
    loop {
        std::thread::sleep(Duration::from_secs(1));
        let now = viewer.picture();
        if now == last {
            break;
        }
        last = now;
    }
    assert!(apart(&last, &first) > 8.0, "{}", apart(&last, &first));
    viewer.desktop.hit(letter('g'));
    viewer.until("the begin of the flight", |picture| apart(picture, &last) > 6.0);
    viewer.until("the last camera", |picture| apart(picture, &last) < 2.0);
    viewer.close();
}

#[test]
fn a_stands_beside_the_path_tracer_and_the_window_closes_while_it_works() {
    let Some(server) = ready() else { return };
    let [width, height] = SIZE.map(usize::from);
    let left = |picture: &[[u8; 3]]| -> Vec<[u8; 3]> {
        picture.chunks(width).take(height).flat_map(|row| row[..width / 2 - 4].to_vec()).collect()
    };
    let right = |picture: &[[u8; 3]]| -> Vec<[u8; 3]> {
        picture.chunks(width).take(height).flat_map(|row| row[width / 2 + 4..].to_vec()).collect()
    };
    // Below the letters A and B.
    let below = |picture: Vec<[u8; 3]>| picture.get((width / 2 - 4) * 30..).unwrap_or_default().to_vec();
    let whole = by_command("render isr --builtin cornell --camera 0");
    let truth = by_command("reference --builtin cornell --camera 0 --spp 4 --exposure 2");
    let viewer = Viewer::bare(&server, "--technique isr --builtin cornell --spp 4 --compare split");
    viewer.until("both sides", |picture| {
        picture.len() == width * height
            && below(left(picture)) == below(left(&whole))
            && below(right(picture)) == below(right(&truth))
    });
    // As long as Space is held, B alone.
    viewer.desktop.key(letter(' '), true);
    viewer.until("B alone", |picture| picture.len() == width * height && below(left(picture)) == below(left(&truth)));
    viewer.desktop.key(letter(' '), false);
    viewer.until("both sides again", |picture| {
        picture.len() == width * height && below(left(picture)) == below(left(&whole))
    });
    viewer.close();

    let viewer = Viewer::bare(&server, "--technique reference --builtin office --spp 100000");
    // The text before it covers less.
    viewer.until("a picture that grows", |picture| {
        picture.iter().filter(|pixel| pixel.iter().any(|code| *code > 40)).count() > width * height / 4
    });
    viewer.close();
}

#[test]
fn settings_of_the_command_line_are_those_of_the_window() {
    let Some(server) = ready() else { return };
    let settings = "-D isr.samples=24 -D isr.k_isr=2 --put 0=0.15,0.4,0.2";
    let expected = by_command(&format!("render isr --builtin cornell --camera 0 {settings}"));
    let viewer = Viewer::bare(&server, &format!("--technique isr --builtin cornell {settings}"));
    viewer.shows("the settings", &expected);
    viewer.close();
}

#[test]
fn a_window_with_panels_opens_and_a_scene_that_cannot_be_read_does_not_close_it() {
    let Some(server) = ready() else { return };
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.glb");
    std::fs::write(&broken, b"glTF, or not").unwrap();
    let size = [900, 600];
    let mut viewer = Viewer::open(&server, size, &broken.display().to_string());
    let before = viewer.until("the panels", |picture| picture.iter().filter(|pixel| pixel[0] > 100).count() > 500);
    std::thread::sleep(Duration::from_millis(500));
    assert!(viewer.child.try_wait().unwrap().is_none(), "the window closed");
    // Its message is red, in the line below.
    let red = |pixel: &&[u8; 3]| pixel[0] > 150 && pixel[1] < 60 && pixel[2] < 60;
    viewer.until("the message", |picture| picture.iter().rev().take(900 * 30).filter(red).count() > 40);
    viewer.desktop.hit(TAB);
    viewer.until("no panels", |picture| picture != before);
    viewer.close();
}

#[test]
fn without_a_display_it_says_so() {
    let mut program = command(env!("CARGO_BIN_EXE_lucerna"));
    program
        .args(["view", "--builtin", "cornell"])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET");
    support::ran(&mut program).expect(4, &["display", "lucerna render"]);
}

#[test]
fn settings_are_printed_without_a_window() {
    let printed =
        lucerna(["view", "--technique", "isr", "-D", "isr.samples=24", "--print-config"]).expect(0, &[]).stdout;
    assert!(printed.contains("samples = 24") && printed.contains("[shadow]"), "{printed}");
}

#[test]
fn wrong_options_are_refused_before_a_window_opens() {
    for (words, parts) in [
        ("view --technique path", &["path"][..]),
        ("view --paper --builtin cornell", &["--technique"]),
        ("view --window 0x5", &["--window"]),
        ("view --spp 0", &["--spp"]),
        ("view --print-config", &["--technique"]),
    ] {
        lucerna(words.split(' ')).expect(2, parts);
    }
}

#[test]
fn lamps_are_dragged_and_the_file_has_the_moved_lamp() {
    let Some(server) = ready() else { return };
    let of = "render isr --builtin cornell --camera 0";
    let whole = by_command(of);
    let viewer = Viewer::bare(&server, "--technique isr --builtin cornell");
    viewer.shows("the picture of render", &whole);
    // The lamp of the box is in the middle of the picture near its upper edge; the ring around it stands where the mouse finds it.
    let [width, height] = SIZE.map(|side| side as i16);
    let found = (4..height / 2).step_by(3).find(|y| {
        viewer.desktop.point(width / 2, *y);
        std::thread::sleep(Duration::from_millis(150));
        viewer
            .picture()
            .iter()
            .filter(|pixel| pixel[0] > 240 && (190..230).contains(&pixel[1]) && pixel[2] < 120)
            .count()
            > 8
    });
    let y = found.expect("a ring around the lamp");
    viewer.desktop.button(1, true);
    for step in 1..=10 {
        viewer.desktop.point(width / 2 - 2 * step, y + step);
        std::thread::sleep(Duration::from_millis(20));
    }
    viewer.desktop.button(1, false);
    viewer.desktop.point(4, 4);
    viewer.until("other light", |picture| picture.len() == whole.len() && *picture != whole[..]);
    viewer.desktop.hit(letter('p'));
    let file = written(viewer.folder.path(), ".png");
    viewer.shows("the picture of the file", &codes(&file));
    lucerna(["rerun".as_ref(), file.as_os_str()]).expect(0, &[]);
    let said = lucerna(["info".as_ref(), "--json".as_ref(), file.as_os_str()]).expect(0, &[]).stdout;
    assert!(said.contains("\"put\""), "{said}");
    viewer.desktop.hit(letter('r'));
    viewer.shows("the lamp in its place", &whole);
    viewer.close();
}

#[test]
fn a_picture_of_a_file_stands_beside_the_rendered_one() {
    let Some(server) = ready() else { return };
    let [width, height] = SIZE.map(usize::from);
    let whole = by_command("render isr --builtin cornell --camera 0");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("direct.png");
    let size = format!("{width}x{height}");
    let words = "render isr --builtin cornell --camera 0 --mode direct -q --size".split(' ');
    lucerna(words.chain([size.as_str(), "-o", file.to_str().unwrap()])).expect(0, &[]);
    let direct = codes(&file);
    let viewer = Viewer::bare(&server, &format!("--technique isr --builtin cornell --against {}", file.display()));
    // Left of the line A, right of the line the codes of the file; below the letters.
    viewer.until("both sides", |picture| {
        picture.len() == width * height
            && (30..height).all(|y| {
                let row = |of: &[[u8; 3]], x: std::ops::Range<usize>| of[y * width..][x].to_vec();
                let (left, right) = (0..width / 2 - 4, width / 2 + 4..width);
                row(picture, left.clone()) == row(&whole, left) && row(picture, right.clone()) == row(&direct, right)
            })
    });
    viewer.close();
}

#[test]
fn a_file_that_is_mended_is_read_again() {
    let Some(server) = ready() else { return };
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("a.glb");
    std::fs::write(&broken, b"no scene").unwrap();
    let scene = folder.path().join("scene.glb");
    lucerna(["export-gltf", "--builtin", "cornell", "-o", scene.to_str().unwrap(), "-q"]).expect(0, &[]);
    let viewer = Viewer::bare(&server, &format!("--technique isr {}", broken.display()));
    std::thread::sleep(Duration::from_secs(1));
    std::fs::copy(&scene, &broken).unwrap();
    viewer.until("the scene that the file has become", |picture| {
        picture.iter().filter(|pixel| pixel[0] > 60).count() > 2000
    });
    viewer.close();
}

#[test]
fn passes_in_text_are_switched_by_keys_and_change_with_their_files() {
    let Some(server) = ready() else { return };
    let folder = tempfile::tempdir().unwrap();
    let here = |name: &str| folder.path().join(name);
    for name in ["sepia.toml", "sepia.frag"] {
        std::fs::copy(support::of_project("samples/effects").join(name), here(name)).unwrap();
    }
    let pipeline = here("sepia.toml").display().to_string();
    let of = "render isr --builtin cornell --camera 0";
    let plain = by_command(of);
    let sepia = by_command(&format!("{of} --effects {pipeline}"));
    assert_ne!(plain, sepia);
    let viewer = Viewer::bare(&server, &format!("--technique isr --builtin cornell --effects {pipeline}"));
    viewer.shows("brown tones", &sepia);
    // F11 switches them off and on.
    viewer.desktop.hit(F1 + 10);
    viewer.shows("no brown tones", &plain);
    viewer.desktop.hit(F1 + 10);
    viewer.shows("brown tones again", &sepia);
    // P writes what is seen.
    viewer.desktop.hit(letter('p'));
    assert_eq!(codes(&written(viewer.folder.path(), ".png")), sepia);

    // Another shader is another picture, without a key.
    let shader = std::fs::read_to_string(here("sepia.frag")).unwrap();
    std::fs::write(here("sepia.frag"), shader.replace("1.18, 0.98, 0.70", "0.70, 0.98, 1.18")).unwrap();
    let blue = by_command(&format!("{of} --effects {pipeline}"));
    assert_ne!(blue, sepia);
    viewer.shows("blue tones", &blue);
    // A mistake leaves the picture as it was, and is gone when it is mended.
    std::fs::write(here("sepia.frag"), shader.replace("luminance *", "lumimance *")).unwrap();
    std::thread::sleep(Duration::from_secs(2));
    viewer.shows("blue tones still", &blue);
    viewer.desktop.hit(F1 + 10);
    viewer.shows("no tones", &plain);
    viewer.desktop.hit(F1 + 10);
    std::fs::write(here("sepia.frag"), &shader).unwrap();
    viewer.shows("brown tones at last", &sepia);
    // A constant with another default in the file.
    let toml = std::fs::read_to_string(here("sepia.toml")).unwrap();
    std::fs::write(here("sepia.toml"), toml.replace("default = true", "default = false")).unwrap();
    viewer.shows("the new default", &plain);
    // A value that was changed by hand stays.
    viewer.desktop.hit(F1 + 10);
    viewer.shows("brown tones by hand", &sepia);
    std::fs::write(here("sepia.toml"), toml.replace("default = true", "default = false") + "\n# another text\n")
        .unwrap();
    std::thread::sleep(Duration::from_secs(2));
    viewer.shows("brown tones stay", &sepia);
    viewer.close();
}
