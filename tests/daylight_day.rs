//! Tests of the civil day and the sun position.

use lucerna::techniques::daylight::day::{Day, Place, Sun};

fn noon_elevation(date: &str, latitude: f64) -> (f64, f64) {
    let day = Day::new(date, "UTC", latitude, 0.0).unwrap();
    let best =
        (0..86_400).step_by(20).map(|s| day.sun(f64::from(s))).max_by(|a, b| a.elevation.total_cmp(&b.elevation));
    let sun = best.unwrap();
    (sun.elevation, sun.azimuth)
}

#[test]
fn noon_elevations_at_the_solstices_follow_the_declination() {
    // The obliquity of the ecliptic is 23.436° in 2026; noon elevation = 90° - |latitude - declination|.
    for (date, latitude, expected, azimuth) in [
        ("2026-06-21", 55.676, 90.0 - 55.676 + 23.436, 180.0),
        ("2026-12-21", 55.676, 90.0 - 55.676 - 23.436, 180.0),
        ("2026-06-21", -33.869, 90.0 - 33.869 - 23.436, 0.0),
        ("2026-12-21", -33.869, 90.0 - 33.869 + 23.436, 0.0),
    ] {
        let (elevation, found) = noon_elevation(date, latitude);
        assert!((elevation - expected).abs() < 0.1, "{date} {latitude}: {elevation}, not {expected}");
        let apart = (found - azimuth + 540.0).rem_euclid(360.0) - 180.0;
        assert!(apart.abs() < 0.3, "{date} {latitude}: azimuth {found}");
    }
}

#[test]
fn the_equinox_sun_passes_the_zenith_of_the_equator() {
    // The equinox is on 2026-03-20 at 14:46 UTC, so the declination at noon is below 0.05°.
    let (elevation, _) = noon_elevation("2026-03-20", 0.0);
    assert!(elevation > 89.9, "{elevation}");
    let day = Day::new("2026-03-20", "UTC", 0.0, 0.0).unwrap();
    assert!((day.sun(6.0 * 3600.0 + 450.0).azimuth - 90.0).abs() < 0.2);
    assert!((day.sun(18.0 * 3600.0 + 450.0).azimuth - 270.0).abs() < 0.2);
}

#[test]
fn the_far_north_has_polar_day_and_polar_night() {
    let summer = Day::new("2026-06-21", "UTC", 80.0, 15.0).unwrap();
    let winter = Day::new("2026-12-21", "UTC", 80.0, 15.0).unwrap();
    for step in summer.steps(10.0, 0.0).unwrap() {
        assert!(summer.sun(step).elevation > 13.0);
        assert!(winter.sun(step).elevation < -13.0);
    }
}

#[test]
fn sunrise_and_sunset_in_greenwich_agree_with_an_almanac() {
    // London (51.48 N, 0 E) on 2026-06-21: sunrise 03:43 UTC and sunset 20:21 UTC. The upper limb then touches the
    // horizon, so the apparent elevation of the centre is near -0.27°.
    let day = Day::new("2026-06-21", "UTC", 51.48, 0.0).unwrap();
    for time in ["03:43", "20:21"] {
        let elevation = day.sun(day.parse_time(time).unwrap()).elevation;
        assert!((elevation + 0.27).abs() < 0.15, "{time}: {elevation}");
    }
}

/// PyEphem 4.2.1, whose planetary theory (VSOP87) is not that of our algorithm: date and UTC, place (degrees), elevation with refraction at 1013 hPa and
/// 12 °C, azimuth.
type Almanac = (&'static str, &'static str, &'static str, f64, f64, f64, f64);
const ALMANAC: [Almanac; 16] = [
    ("2026-03-20", "12:00", "equator, equinox", 0.0, 0.0, 88.141, 91.400),
    ("2026-03-20", "08:30", "Copenhagen", 55.676, 12.568, 24.795, 132.773),
    ("2026-06-21", "11:10", "Copenhagen", 55.676, 12.568, 57.769, 179.339),
    ("2026-12-21", "09:00", "Copenhagen", 55.676, 12.568, 6.477, 150.772),
    ("2026-09-23", "02:00", "Sydney", -33.869, 151.209, 56.048, 354.482),
    ("2026-06-21", "04:00", "Sydney", -33.869, 151.209, 25.682, 328.618),
    ("2026-12-21", "20:00", "Sydney", -33.869, 151.209, 14.160, 108.985),
    ("2026-06-21", "00:30", "Longyearbyen, polar day", 78.223, 15.627, 12.578, 21.264),
    ("2026-12-21", "11:00", "Longyearbyen, polar night", 78.223, 15.627, -11.664, 181.045),
    ("2026-02-01", "17:00", "Quito", -0.18, -78.468, 71.918, 158.405),
    ("2026-10-25", "01:30", "London, clock change", 51.507, -0.128, -45.146, 37.967),
    ("2026-03-29", "06:30", "London, clock change", 51.507, -0.128, 6.628, 92.714),
    ("2026-08-16", "18:00", "Aalborg", 57.048, 9.919, 6.744, 284.760),
    ("2000-01-01", "15:00", "New York", 40.713, -74.006, 20.529, 150.731),
    ("2050-07-04", "21:00", "Los Angeles", 34.052, -118.244, 72.290, 234.586),
    ("2026-12-21", "03:00", "McMurdo, polar day", -77.846, 166.676, 33.544, 324.087),
];

#[test]
fn the_sun_stands_where_another_almanac_says() {
    for (date, time, name, latitude, longitude, elevation, azimuth) in ALMANAC {
        let day = Day::new(date, "UTC", latitude, longitude).unwrap();
        let sun = day.sun(day.parse_time(time).unwrap());
        let around = ((sun.azimuth - azimuth + 540.0).rem_euclid(360.0) - 180.0) * elevation.to_radians().cos();
        assert!(around.abs() < 0.01, "{name}, {date} {time}: azimuth {}, not {azimuth}", sun.azimuth);
        // Programs have different refraction near the horizon, and below it.
        let slack = if elevation > 0.0 { 0.02 } else { 0.6 };
        assert!((sun.elevation - elevation).abs() < slack, "{name}, {date} {time}: {}, not {elevation}", sun.elevation);
    }
}

#[test]
fn a_day_with_a_clock_change_has_23_or_25_hours() {
    let spring = Day::new("2026-03-29", "Europe/Copenhagen", 55.676, 12.568).unwrap();
    assert_eq!(spring.length(), 23.0 * 3600.0);
    assert_eq!(spring.end() - spring.start(), 23 * 3600);
    assert_eq!(spring.steps(60.0, 0.0).unwrap().len(), 23);
    assert_eq!(spring.parse_time("01:59:59").unwrap(), 7199.0);
    assert_eq!(spring.parse_time("03:00").unwrap(), 7200.0);
    assert_eq!(spring.label(7200.0), "03:00:00");
    let error = spring.parse_time("02:30").unwrap_err();
    assert!(error.contains("doesn't exist") && error.contains("02:30"), "{error}");

    let autumn = Day::new("2026-10-25", "Europe/Copenhagen", 55.676, 12.568).unwrap();
    assert_eq!(autumn.length(), 25.0 * 3600.0);
    assert_eq!(autumn.steps(60.0, 30.0).unwrap().len(), 25);
    assert_eq!(autumn.parse_time("02:30").unwrap(), 9000.0);
    assert_eq!(autumn.parse_time("03:00").unwrap(), 4.0 * 3600.0);
    assert_eq!(autumn.label(9000.0), "02:30:00");
    assert_eq!(autumn.label(9000.0 + 3600.0), "02:30:00");

    let plain = Day::new("2026-06-21", "Europe/Copenhagen", 55.676, 12.568).unwrap();
    assert_eq!(plain.length(), 86_400.0);
    // 2026-06-20T22:00:00Z
    assert_eq!(plain.start(), 1_781_992_800);
}

#[test]
fn a_midnight_that_the_clock_skips_or_repeats_is_handled() {
    // The clock of Sao Paulo went from 00:00 to 01:00.
    let skipped = Day::new("2018-11-04", "America/Sao_Paulo", -23.55, -46.63).unwrap();
    assert_eq!(skipped.length(), 23.0 * 3600.0);
    assert_eq!(skipped.label(0.0), "01:00:00");
    // The clock of Toronto went from 23:30 to 00:30.
    let toronto = Day::new("1919-03-31", "America/Toronto", 43.65, -79.38).unwrap();
    assert_eq!(toronto.length(), 23.5 * 3600.0);
    assert_eq!(toronto.label(0.0), "00:30:00");
    // The clock of Havana goes from 01:00 back to 00:00.
    let repeated = Day::new("2025-11-02", "America/Havana", 23.1, -82.4).unwrap();
    assert_eq!(repeated.length(), 25.0 * 3600.0);
    assert_eq!(repeated.parse_time("00:30").unwrap(), 1800.0);
    // Samoa skipped a whole day.
    let error = Day::new("2011-12-30", "Pacific/Apia", -13.8, -171.8).unwrap_err();
    assert!(error.contains("2011-12-30") && error.contains("skipped"), "{error}");
}

#[test]
fn steps_cover_the_day() {
    let day = Day::new("2026-06-21", "+02:00", 55.676, 12.568).unwrap();
    let steps = day.steps(15.0, 7.5).unwrap();
    assert_eq!(steps.len(), 96);
    assert_eq!(steps[0], 450.0);
    assert_eq!(steps[95], 86_400.0 - 450.0);
    assert_eq!(day.steps(1440.0, 0.0).unwrap(), [0.0]);
    assert_eq!(day.steps(1.0 / 60.0, 0.0).unwrap().len(), 86_400);
    for (interval, offset) in
        [(0.0, 0.0), (-5.0, 0.0), (f64::NAN, 0.0), (f64::INFINITY, 0.0), (15.0, -1.0), (15.0, 15.0)]
    {
        assert!(day.steps(interval, offset).is_err(), "{interval} {offset}");
    }
}

#[test]
fn times_and_labels_are_inverse() {
    let day = Day::new("2026-06-21", "+02:00", 55.676, 12.568).unwrap();
    for text in ["00:00:00", "07:40:30", "23:59:59"] {
        assert_eq!(day.label(day.parse_time(text).unwrap()), text);
    }
    assert_eq!(day.parse_time("07:40").unwrap(), 27_600.0);
    for text in ["", "7:40", "24:00", "07:60", "07:40:60", "07:40:00:00", "07.40", "+7:40", "ab:cd"] {
        let error = day.parse_time(text).unwrap_err();
        assert!(error.contains(&format!("\"{text}\"")), "{error}");
    }
    assert_eq!(day.label(f64::NAN), "--:--:--");
    assert_eq!(day.label(1e300), "--:--:--");
}

#[test]
fn zones_are_read_in_three_forms() {
    let start = |zone: &str| Day::new("2026-06-21", zone, 0.0, 0.0).map(|day| day.start());
    let utc = start("UTC").unwrap();
    assert_eq!(utc % 86_400, 0);
    assert_eq!(start("+02:00").unwrap(), utc - 7200);
    assert_eq!(start("-03:30").unwrap(), utc + 12_600);
    assert_eq!(start("Europe/Copenhagen").unwrap(), utc - 7200);
    assert_eq!(start("America/New_York").unwrap(), utc + 4 * 3600);
    for zone in ["", "Europe/Nowhere", "+2", "+02:60", "+14:01", "+é:00", "CET-1CEST", "Mars/Olympus"] {
        let error = start(zone).unwrap_err();
        assert!(error.contains(&format!("\"{zone}\"")) && error.contains("Europe/Copenhagen"), "{error}");
    }
}

#[test]
fn bad_dates_and_places_are_refused() {
    for date in ["2026-02-29", "2026-6-21", "21.06.2026", "", "2026-06-21T12:00", "3000-01-01"] {
        let error = Day::new(date, "UTC", 0.0, 0.0).unwrap_err();
        assert!(error.contains(&format!("\"{date}\"")), "{error}");
    }
    assert!(Place::new(90.5, 0.0).unwrap_err().contains("90.5"));
    assert!(Place::new(0.0, -181.0).unwrap_err().contains("-181"));
    assert!(Place::new(f64::NAN, 0.0).is_err());
    assert!(Place::new(-90.0, 180.0).is_ok());
}

#[test]
fn the_direction_follows_the_frame() {
    let close = |a: [f32; 3], b: [f32; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-6);
    let north = Sun { elevation: 0.0, azimuth: 0.0 };
    let east = Sun { elevation: 0.0, azimuth: 90.0 };
    let up = Sun { elevation: 90.0, azimuth: 17.0 };
    assert!(close(north.direction(0.0), [0.0, 0.0, -1.0]));
    assert!(close(east.direction(0.0), [1.0, 0.0, 0.0]));
    assert!(close(up.direction(0.0), [0.0, 1.0, 0.0]));
    // North turns clockwise as seen from above: from -Z over +X to +Z.
    assert!(close(north.direction(90.0), [1.0, 0.0, 0.0]));
    assert!(close(north.direction(180.0), [0.0, 0.0, 1.0]));
    assert!(close(east.direction(90.0), [0.0, 0.0, 1.0]));
    assert!(close(north.direction(-90.0), [-1.0, 0.0, 0.0]));
}
