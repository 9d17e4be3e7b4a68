//! The days of a bake, their times and the names of these, and the light from outside at each minute.

use half::f16;
use lucerna::{
    Error, Result,
    image::{Ktx2Format, encode_ktx2},
    techniques::daylight::{Course, NEXT_DAY, Plan, Weather, export::Moment, steps::Steps},
};
use serde_json::{Value, json};

use super::Folder;

/// Seconds between two rows of the light from outside.
const STEP: u32 = 60;

/// A day of a bake.
pub struct OneDay {
    /// Empty for a path of the sun.
    pub date: String,
    pub course: Course,
    pub steps: Steps,
    /// Number of the day in the plan.
    number: usize,
    /// First and last moment with light, seconds.
    pub span: Option<[f64; 2]>,
}

impl OneDay {
    /// All days of a plan.
    ///
    /// # Errors
    /// `Input` if a day is impossible.
    pub fn all(plan: &Plan) -> Result<Vec<Self>> {
        let courses = plan.calendar.courses().map_err(Error::input)?;
        let days = courses.into_iter().zip(plan.calendar.dates()).enumerate();
        let day = |(number, (course, date)): (usize, (Course, &str))| Self {
            date: date.to_owned(),
            steps: Steps::new(plan, number, &course),
            course,
            number,
            span: plan.calendar.span,
        };
        Ok(days.map(day).collect())
    }

    /// The baked times, seconds after the begin of the day.
    pub fn times(&self, plan: &Plan) -> impl Iterator<Item = f64> {
        let begin = NEXT_DAY * self.number as f64;
        plan.times[plan.of_day(self.number)].iter().map(move |time| time.seconds - begin)
    }

    /// Number of the first time among all times of the bake.
    pub fn first_column(&self, plan: &Plan) -> usize {
        plan.of_day(self.number).start
    }

    /// The seconds of a time as text.
    ///
    /// # Errors
    /// `Usage` if it is no time of the day, or if the bake has no light then.
    pub fn parse(&self, text: &str) -> Result<f64> {
        let seconds = self.course.parse_time(text).map_err(|what| Error::usage(what).at("--time"))?;
        if let Some([from, until]) = self.span
            && !(from..=until).contains(&seconds)
        {
            let [from, until] = [from, until].map(|seconds| self.course.label(seconds));
            let what = format!("{text}: the bake has light from {from} until {until}");
            return Err(Error::usage(what).at("--time").help("Choose other times, or bake the whole day"));
        }
        Ok(seconds)
    }

    /// The light at a time, with lamps that are off.
    ///
    /// # Errors
    /// `Usage` if the weather is impossible.
    pub fn moment(&self, seconds: f64, weather: Weather) -> Result<Moment> {
        Moment::new(&self.course, &self.steps, seconds, weather)
    }
}

/// A time of a day and its name in file names: `0740`, or with several days `2026-06-21-0740`.
pub struct Clock {
    /// Number among the days.
    pub day: usize,
    pub seconds: f64,
    pub label: String,
    pub name: String,
}

impl Clock {
    /// `several`: names have the date.
    pub fn new(of: &OneDay, day: usize, seconds: f64, several: bool) -> Self {
        let label = of.course.label(seconds);
        let digits: String = label.chars().filter(char::is_ascii_digit).collect();
        let name = digits.strip_suffix("00").unwrap_or(&digits).to_owned();
        let name = if several { format!("{}-{name}", of.date) } else { name };
        Self { day, seconds, label, name }
    }

    /// Makes the names different where the clock goes back and a time comes twice.
    pub fn named_apart(clocks: &mut [Self]) {
        for at in 1..clocks.len() {
            let (before, rest) = clocks.split_at_mut(at);
            if before.iter().any(|clock| clock.name == rest[0].name && clock.seconds != rest[0].seconds) {
                rest[0].name.push('b');
            }
        }
    }
}

/// Writes the light from outside for each minute: a row of the radiances of all patches of the sky, then the irradiance of the sun, then the
/// direction towards it. Rows begin and end with the last minutes that have light.
///
/// # Errors
/// `Output`; `Usage` if the weather is impossible.
pub fn write(folder: &mut Folder<'_>, day: &OneDay, weather: Weather, several: bool) -> Result<Value> {
    let count = (day.course.length() / f64::from(STEP)).ceil() as u32 + 1;
    let rows = rows(day, weather, count)?;
    let [from, until] = day.span.unwrap_or([0.0, f64::INFINITY]);
    let dark = |minute: usize| {
        let row = &rows[minute];
        // A part of a day has no light before and after it.
        let [begin, end] = [minute as f64 - 1.0, minute as f64 + 1.0].map(|at| at * f64::from(STEP));
        end <= from || begin >= until || row[..row.len() - 1].iter().flatten().all(|value| *value == 0.0)
    };
    let first = (0..rows.len()).position(|minute| !dark(minute)).unwrap_or(0);
    let last = (0..rows.len()).rposition(|minute| !dark(minute)).unwrap_or(0);
    let rows = &rows[first..=last];
    let half = |value: f32| f16::from_f32(value.min(f16::MAX.to_f32())).to_le_bytes();
    let bytes = rows.iter().flatten().flat_map(|[r, g, b]| [*r, *g, *b, 1.0].map(half)).flatten().collect();
    let columns = rows[0].len() as u32;
    let file = if several { format!("moments-{}.ktx2", day.date) } else { "moments.ktx2".to_owned() };
    let extent = [columns, rows.len() as u32];
    folder.write(file.clone(), &encode_ktx2(Ktx2Format::R16g16b16a16Sfloat, extent, &[bytes], &[])?)?;
    Ok(json!({
        "file": file,
        "first_seconds": first as u32 * STEP,
        "step_seconds": STEP,
        "rows": rows.len(),
        "patches": columns - 2,
        "sun_column": columns - 2,
        "direction_column": columns - 1,
    }))
}

/// The rows of all minutes of a day.
fn rows(day: &OneDay, weather: Weather, count: u32) -> Result<Vec<Vec<[f32; 3]>>> {
    let row = |minute: u32| {
        let moment = day.moment(f64::from(minute * STEP), weather)?;
        Ok([moment.patches, vec![moment.sun, moment.direction]].concat())
    };
    let threads = std::thread::available_parallelism().map_or(1, |threads| threads.get() as u32);
    let share = count.div_ceil(threads);
    std::thread::scope(|scope| {
        let row = &row;
        let parts: Vec<_> = (0..threads)
            .map(|part| (part * share).min(count)..((part + 1) * share).min(count))
            .map(|minutes| scope.spawn(move || minutes.map(row).collect::<Result<Vec<_>>>()))
            .collect();
        let mut out = Vec::with_capacity(count as usize);
        for part in parts {
            out.extend(part.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
        }
        Ok(out)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna::techniques::daylight::Calendar;

    #[test]
    fn times_that_come_twice_get_names_of_their_own() {
        let calendar = Calendar {
            date: "2026-10-25".into(),
            zone: "Europe/Copenhagen".into(),
            latitude: 55.5,
            longitude: 10.0,
            ..Calendar::default()
        };
        let course = calendar.courses().unwrap().remove(0);
        let named = |hour: f64| {
            let label = course.label(3600.0 * hour);
            let digits: String = label.chars().filter(char::is_ascii_digit).collect();
            Clock { day: 0, seconds: 3600.0 * hour, label, name: digits[..4].to_owned() }
        };
        let mut clocks: Vec<Clock> = [2.0, 2.5, 3.0, 3.5].map(named).into();
        Clock::named_apart(&mut clocks);
        let names: Vec<&str> = clocks.iter().map(|clock| clock.name.as_str()).collect();
        assert_eq!(names, ["0200", "0230", "0200b", "0230b"]);
    }
}
