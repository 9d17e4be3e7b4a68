//! `--camera-path`: a flight of the camera through the views of a list.

use std::{fmt, path::Path, str::FromStr};

use glam::Vec3;
use lucerna::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::{as_text::as_text, camera::CameraFile, views::ViewList};

/// Most views of a path.
const MOST: usize = 10_000;
/// Usual time from a view to the next, seconds.
pub const SECONDS: f64 = 2.0;
/// Longest time from a view to the next, seconds.
const LONGEST: f64 = 1e6;

/// A list of views and a time: `LIST.toml[,SECONDS]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Named {
    pub list: String,
    pub seconds: f64,
}

impl FromStr for Named {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (list, seconds) = match text.rsplit_once(',') {
            Some((list, seconds)) => {
                let seconds =
                    seconds.trim().parse::<f64>().ok().filter(|seconds| *seconds > 0.0 && *seconds <= LONGEST);
                (
                    list,
                    seconds.ok_or_else(|| {
                        format!("{seconds:?} is no time above 0, up to {LONGEST} s; expected LIST.toml[,SECONDS]")
                    })?,
                )
            }
            None => (text, SECONDS),
        };
        if list.is_empty() {
            return Err("expected LIST.toml[,SECONDS]".into());
        }
        Ok(Self { list: list.to_owned(), seconds })
    }
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.list, self.seconds)
    }
}

as_text!(Named);

impl Named {
    /// Reads the list.
    ///
    /// # Errors
    /// As [`ViewList::read`] and [`CameraPath::check`].
    pub fn read(&self) -> Result<CameraPath> {
        let list = ViewList::read(Path::new(&self.list))?;
        let views = list.views.iter().map(|view| view.camera()).collect();
        let path = CameraPath { views, seconds: self.seconds };
        path.check().map_err(|what| Error::input(what).in_file(&self.list))?;
        Ok(path)
    }
}

/// A flight through views: places lie on a Catmull-Rom curve (Catmull and Rom 1974), and so do directions, which are normalised; the distance of the
/// target, the angle of view and the near plane change linearly. Before its begin and after its end the camera stands still.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPath {
    pub views: Vec<CameraFile>,
    /// From each view to the next.
    pub seconds: f64,
}

impl CameraPath {
    /// What is wrong with it.
    ///
    /// # Errors
    /// A text that names the number or the view.
    pub fn check(&self) -> Result<(), String> {
        if !(2..=MOST).contains(&self.views.len()) {
            return Err(format!("a path has 2 to {MOST} views; found: {}", self.views.len()));
        }
        if !(self.seconds > 0.0 && self.seconds <= LONGEST) {
            return Err(format!(
                "the time between two views is {} s; allowed: above 0, at most {LONGEST}",
                self.seconds
            ));
        }
        for (index, view) in self.views.iter().enumerate() {
            view.check().map_err(|what| format!("view {index}: {what}"))?;
        }
        Ok(())
    }

    /// Time of the last view.
    pub fn end(&self) -> f64 {
        self.views.len().saturating_sub(1) as f64 * self.seconds
    }

    /// The camera at a time, seconds.
    pub fn at(&self, seconds: f64) -> CameraFile {
        let last = self.views.len() - 1;
        let place = (seconds / self.seconds).clamp(0.0, last as f64);
        let first = (place.floor() as usize).min(last.saturating_sub(1));
        let share = (place - first as f64) as f32;
        let near = &self.views[if share < 0.5 { first } else { (first + 1).min(last) }];
        if share == 0.0 || share == 1.0 {
            return near.clone();
        }
        let four = |of: &dyn Fn(&CameraFile) -> Vec3| {
            let [b, c] = [first, first + 1].map(|index| of(&self.views[index]));
            // The ends go on as straight lines.
            let a = if first > 0 { of(&self.views[first - 1]) } else { b + b - c };
            let d = if first + 2 <= last { of(&self.views[first + 2]) } else { c + c - b };
            between([a, b, c, d], share)
        };
        let position = four(&|view| view.position);
        let way = |view: &CameraFile| view.target - view.position;
        let (forward, up) = (four(&|view| way(view).normalize()), four(&|view| view.up.normalize()));
        let line = |of: &dyn Fn(&CameraFile) -> f32| {
            let [b, c] = [first, first + 1].map(|index| of(&self.views[index]));
            b + share * (c - b)
        };
        let found = CameraFile {
            position,
            target: position + forward.normalize_or_zero() * line(&|view| way(view).length()),
            up: up.normalize_or_zero(),
            yfov_degrees: line(&|view| view.yfov_degrees),
            znear: line(&|view| view.znear),
            zfar: near.zfar,
        };
        // Between two opposite directions there is none: the camera keeps that of the nearer view until it can turn.
        if found.check().is_ok() {
            found
        } else {
            CameraFile { position, target: position + way(near), ..near.clone() }
        }
    }
}

/// The Catmull-Rom curve from the second point to the third.
fn between([a, b, c, d]: [Vec3; 4], t: f32) -> Vec3 {
    let tangents = [0.5 * (c - a), 0.5 * (d - b)];
    let (t2, t3) = (t * t, t * t * t);
    b * (2.0 * t3 - 3.0 * t2 + 1.0)
        + tangents[0] * (t3 - 2.0 * t2 + t)
        + c * (3.0 * t2 - 2.0 * t3)
        + tangents[1] * (t3 - t2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(position: Vec3, target: Vec3) -> CameraFile {
        CameraFile { position, target, up: Vec3::Y, yfov_degrees: 45.0, znear: 0.1, zfar: None }
    }

    fn path(views: Vec<CameraFile>) -> CameraPath {
        let path = CameraPath { views, seconds: 2.0 };
        path.check().unwrap();
        path
    }

    #[test]
    fn the_camera_is_at_each_view_at_its_time_and_moves_smoothly_between() {
        let views = vec![
            view(Vec3::ZERO, Vec3::NEG_Z),
            CameraFile { yfov_degrees: 60.0, ..view(Vec3::X, Vec3::new(3.0, 0.0, -1.0)) },
            view(Vec3::new(1.0, 1.0, 2.0), Vec3::new(0.0, 0.0, 2.0)),
            view(Vec3::new(4.0, 1.0, 2.0), Vec3::new(4.0, 0.5, -3.0)),
        ];
        let path = path(views.clone());
        assert_eq!(path.end(), 6.0);
        for (index, view) in views.iter().enumerate() {
            assert_eq!(path.at(2.0 * index as f64), *view);
        }
        assert_eq!((path.at(-1.0), path.at(7.0)), (views[0].clone(), views[3].clone()));
        assert_eq!(path.at(1.0).yfov_degrees, 52.5);
        let direction = |camera: &CameraFile| (camera.target - camera.position).normalize();
        let mut before = path.at(0.0);
        let mut speeds = Vec::new();
        for step in 1..=600 {
            let now = path.at(f64::from(step) * 0.01);
            now.check().unwrap();
            let moved = (now.position - before.position).length();
            assert!(moved < 0.03 && (direction(&now) - direction(&before)).length() < 0.03, "{step}: {moved}");
            speeds.push(moved);
            before = now;
        }
        // Also the speed has no jumps, at the views either.
        assert!(speeds.windows(2).all(|two| (two[1] - two[0]).abs() < 2e-3), "{speeds:?}");
    }

    #[test]
    fn two_views_are_a_straight_flight() {
        let path = path(vec![view(Vec3::ZERO, Vec3::NEG_Z), view(Vec3::X * 4.0, Vec3::new(4.0, 0.0, -1.0))]);
        for step in 0..=8 {
            let share = step as f32 / 8.0;
            let camera = path.at(f64::from(2.0 * share));
            assert!(camera.position.abs_diff_eq(Vec3::X * 4.0 * share, 1e-5), "{camera:?}");
            assert!(camera.target.abs_diff_eq(camera.position + Vec3::NEG_Z, 1e-5), "{camera:?}");
        }
    }

    #[test]
    fn opposite_directions_have_a_camera_at_every_time() {
        let path = path(vec![view(Vec3::ZERO, Vec3::NEG_Z), view(Vec3::X, Vec3::new(1.0, 0.0, 1.0))]);
        for step in 0..=100 {
            path.at(0.02 * f64::from(step)).check().unwrap();
        }
    }

    #[test]
    fn texts_are_read_and_wrong_paths_are_refused() {
        let named: Named = "a,b.toml,0.5".parse().unwrap();
        assert_eq!((named.list.as_str(), named.seconds), ("a,b.toml", 0.5));
        assert_eq!(named.to_string().parse::<Named>().unwrap(), named);
        assert_eq!("a.toml".parse::<Named>().unwrap().seconds, SECONDS);
        for bad in ["", ",1", "a.toml,0", "a.toml,-1", "a.toml,nan", "a.toml,x", "a.toml,1e9"] {
            assert!(bad.parse::<Named>().is_err(), "{bad}");
        }
        let one = CameraPath { views: vec![view(Vec3::ZERO, Vec3::X)], seconds: 1.0 };
        assert!(one.check().unwrap_err().contains("2 to 10000 views"));
        let stands = CameraPath { views: vec![view(Vec3::ZERO, Vec3::X); 2], seconds: f64::NAN };
        assert!(stands.check().unwrap_err().contains("time between"));
        let bad = CameraPath { views: vec![view(Vec3::ZERO, Vec3::X), view(Vec3::X, Vec3::X)], seconds: 1.0 };
        assert!(bad.check().unwrap_err().starts_with("view 1"));
        assert_eq!("no/such.toml".parse::<Named>().unwrap().read().unwrap_err().exit_code(), 3);
    }
}
