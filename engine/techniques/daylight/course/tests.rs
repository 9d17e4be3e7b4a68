use super::*;

fn calendar(path: Option<SunPath>) -> Calendar {
    Calendar { date: "2026-06-21".into(), zone: "UTC".into(), latitude: 51.5, path, ..Calendar::default() }
}

fn only(calendar: &Calendar) -> Course {
    let mut courses = calendar.courses().unwrap();
    assert_eq!(courses.len(), 1);
    courses.remove(0)
}

fn course(text: &str) -> Course {
    only(&calendar(Some(SunPath::from_csv(text).unwrap())))
}

fn apart(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f32>().sqrt()
}

#[test]
fn a_path_of_an_almanac_gives_the_suns_of_the_almanac() {
    let day = only(&calendar(None));
    let Course::Almanac { day: almanac, .. } = &day else { panic!("no date") };
    let mut text = String::from("# every two minutes\ntime,azimuth,elevation\n");
    for seconds in (0..86_400).step_by(120) {
        let sun = almanac.sun(f64::from(seconds));
        text += &format!("{},{},{}\n", almanac.label(f64::from(seconds)), sun.azimuth, sun.elevation);
    }
    let path = course(&text);
    for seconds in (0..86_280).step_by(290) {
        let [theirs, ours] = [&day, &path].map(|course| course.sun(f64::from(seconds)));
        assert!(apart(theirs.direction, ours.direction) < 5e-4, "{seconds}");
        assert_eq!(theirs.irradiance, None);
        assert_eq!(ours.irradiance, None);
    }
    assert_eq!(path.steps(15.0, 5.0), day.steps(15.0, 5.0));
    for text in ["00:00", "07:40:30", "23:59:59"] {
        assert_eq!(path.parse_time(text), day.parse_time(text));
        assert_eq!(path.label(path.parse_time(text).unwrap()), day.label(day.parse_time(text).unwrap()));
    }
}

#[test]
fn both_kinds_of_file_say_the_same() {
    let csv = "time, x, y, z, red, green, blue\n06:00, 2, 0, 0, 1, 0.5, 0\n\n12:00, 0, 4, 0, 3, 1.5, 1\n";
    let toml = "[[sun]]\ntime = \"06:00\"\ndirection = [2, 0, 0]\nirradiance = [1, 0.5, 0]\n\
                [[sun]]\ntime = \"12:00:00\"\ndirection = [0, 4, 0]\nirradiance = [3, 1.5, 1]\n";
    let path = SunPath::from_csv(csv).unwrap();
    assert_eq!(SunPath::from_toml(toml).unwrap(), path);
    // A stored path is the same path.
    let stored = serde_json::to_string(&path).unwrap();
    assert_eq!(serde_json::from_str::<SunPath>(&stored).unwrap(), path);
    let course = course(csv);
    let half = course.sun(9.0 * 3600.0);
    assert!(apart(half.direction, [0.5f32.sqrt(), 0.5f32.sqrt(), 0.0]) < 1e-6);
    assert_eq!(half.irradiance, Some([2.0, 1.0, 0.5]));
    assert_eq!(course.sun(12.0 * 3600.0).irradiance, Some([3.0, 1.5, 1.0]));
    for night in [6.0 * 3600.0 - 1.0, 12.0 * 3600.0 + 1.0] {
        assert!(!course.sun(night).is_lit());
    }
    assert!(course.sun(6.0 * 3600.0).is_lit());
}

#[test]
fn north_turns_azimuths_and_no_directions() {
    for (text, turned) in [
        ("time,azimuth,elevation\n06:00,0,0\n18:00,0,0\n", [1.0, 0.0, 0.0]),
        ("time,x,y,z\n06:00,0,0,-1\n18:00,0,0,-1\n", [0.0, 0.0, -1.0]),
    ] {
        let path = SunPath::from_csv(text).unwrap();
        let course = only(&Calendar { north: 90.0, ..calendar(Some(path)) });
        assert!(apart(course.sun(40_000.0).direction, turned) < 1e-6);
    }
}

#[test]
fn opposite_directions_are_joined_over_the_zenith() {
    let course = course("time,x,y,z\n06:00,1,0,0\n18:00,-1,0,0\n");
    assert!(apart(course.sun(12.0 * 3600.0).direction, [0.0, 1.0, 0.0]) < 1e-6);
    // Overflow of the length is none.
    let far = super::tests::course("time,x,y,z\n06:00,1e300,1e300,0\n18:00,0,1e-20,0\n");
    assert!(apart(far.sun(6.0 * 3600.0).direction, [0.5f32.sqrt(), 0.5f32.sqrt(), 0.0]) < 1e-6);
}

#[test]
fn wrong_files_name_the_line_and_what_is_allowed() {
    let head = "time,azimuth,elevation\n";
    let csv = |text: &str| SunPath::from_csv(text).unwrap_err().to_string();
    for (text, parts) in [
        (String::new(), &["empty", "azimuth"][..]),
        ("when,azimuth,elevation\n".into(), &["line 1", "when", "azimuth"]),
        (format!("{head}06:00,0,0\n"), &["1 times", "at least 2"]),
        (format!("{head}06:00,0,0\n\n# later\n07:00,0\n"), &["line 5", "2 values", "3 columns"]),
        (format!("{head}06:00,0,0\n07:00,south,3\n"), &["line 3", "`azimuth`", "`south`", "number"]),
        (format!("{head}06:00,0,0\n07:00,nan,3\n"), &["line 3", "azimuth", "NaN"]),
        (format!("{head}06:00,0,0\n07:00,3,91\n"), &["line 3", "91", "-90 to 90"]),
        (format!("{head}06:00,0,0\n7:00,3,1\n"), &["line 3", "7:00"]),
        (format!("{head}06:00,0,0\n06:00,3,1\n"), &["line 3", "order"]),
        ("time,x,y,z\n06:00,0,0,0\n".into(), &["line 2", "longer than 0"]),
        ("time,x,y,z,red,green,blue\n06:00,0,1,0,1,-1,1\n".into(), &["line 2", "-1", "irradiance"]),
    ] {
        let said = csv(&text);
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    }
    let toml = |text: &str| SunPath::from_toml(text).unwrap_err().to_string();
    for (text, parts) in [
        ("[[sun]]\ntime = 6\n", &["line 2"][..]),
        ("[[sun]]\ntime = \"06:00\"\nazimut = 3\n", &["line 3", "azimut"]),
        ("[[sun]]\ntime = \"06:00\"\nazimuth = 3\n", &["line 1", "elevation"]),
        (
            "[[sun]]\ntime = \"06:00\"\ndirection = [0, 1, 0]\n\n[[sun]]\ntime = \"05:00\"\ndirection = [0, 1, 0]\n",
            &["line 5"],
        ),
        ("[[sun]]\ntime = \"06:00\"\ndirection = [0, 1, 0]\n", &["at least 2"]),
    ] {
        let said = toml(text);
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    }
}

#[test]
fn several_days_have_their_own_suns_and_no_day_is_there_twice() {
    let dates =
        |dates: &[&str]| Calendar { dates: dates.iter().map(|date| (*date).to_owned()).collect(), ..calendar(None) };
    let courses = dates(&["2026-12-21", "2026-03-20"]).courses().unwrap();
    let heights = courses.iter().map(|course| course.sun(12.0 * 3600.0).direction[1]).collect::<Vec<_>>();
    assert!(heights[0] > heights[2] && heights[2] > heights[1], "{heights:?}");
    for (days, part) in [(&["2026-06-21"][..], "2026-06-21 is there twice"), (&["2026-02-30"], "2026-02-30")] {
        assert!(dates(days).courses().unwrap_err().contains(part));
    }
}
