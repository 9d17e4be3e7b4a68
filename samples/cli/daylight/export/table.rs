//! The principal components of a bake: images, coefficients, and the table that names them.

use half::f16;
use lucerna::{
    Result,
    image::{Ktx2Format, encode_ktx2},
    techniques::daylight::{
        Course, Stored, Weather,
        export::{self, Moment, Page, Pages},
        steps::Steps,
    },
};
use serde_json::{Value, json};

use super::Folder;
use crate::program;

/// What the numbers of lightmaps are.
pub const UNIT: &str = "irradiance in W/m2, linear Rec. 709; reflected radiance = albedo / pi * irradiance";

/// Seconds between two rows of the light from outside.
const STEP: u32 = 60;

/// Writes the images and gives the document that describes them.
pub fn write(
    folder: &mut Folder<'_>,
    stored: &Stored,
    (day, steps): (&Course, &Steps),
    weather: Weather,
    uv_set: u32,
) -> Result<Value> {
    let plan = &stored.plan;
    let calendar = &plan.calendar;
    let layers = export::layers(stored);
    let mut described = Vec::new();
    for pages in &layers {
        described.push(layer(folder, pages)?);
    }
    let tiles: Vec<Value> = (0..stored.tiles.len())
        .map(|number| {
            let [x, y, width, height] = plan.tile(number as u32);
            let of = |pages: &Pages| {
                let spots: Vec<[u32; 3]> =
                    pages.spots[number].iter().map(|spot| [spot.page, spot.corner[0], spot.corner[1]]).collect();
                json!({ "row": pages.rows[number], "images": spots })
            };
            let members = layers.iter().map(|pages| (pages.name.to_owned(), of(pages)));
            let mut tile = json!({ "x": x, "y": y, "width": width, "height": height });
            tile.as_object_mut().into_iter().for_each(|tile| tile.extend(members.clone()));
            tile
        })
        .collect();
    Ok(json!({
        "format": "lucerna daylight export",
        "version": 1,
        "generator": format!("lucerna {}", program::VERSION),
        "scene": { "name": plan.scene, "file": "scene.glb", "texcoord": uv_set },
        "unit": UNIT,
        "width": plan.extent[0],
        "height": plan.extent[1],
        "sources": "sources.ktx2",
        "day": {
            "date": calendar.date,
            "zone": calendar.zone,
            "latitude": calendar.latitude,
            "longitude": calendar.longitude,
            "north": calendar.north,
            "seconds": day.length(),
        },
        "weather": {
            "turbidity": weather.turbidity(),
            "ground_albedo": weather.ground_albedo(),
            "overcast": weather.overcast(),
        },
        "times": plan.times[plan.of_day(0)].iter().map(|time| time.seconds).collect::<Vec<_>>(),
        "nights": steps.nights().collect::<Vec<_>>(),
        "moments": moments(folder, (day, steps), weather)?,
        "tolerance": plan.settings.tolerance,
        "layers": described,
        "tiles": tiles,
    }))
}

/// Writes the pages and the table of one kind of light.
fn layer(folder: &mut Folder<'_>, pages: &Pages) -> Result<Value> {
    let Pages { name, dimensions, columns, .. } = pages;
    let mut files = Vec::new();
    for (number, page) in pages.pages.iter().enumerate() {
        let file = format!("{name}-{number:02}.ktx2");
        folder.write(file.clone(), &page_bytes(page)?)?;
        files.push(file);
    }
    let table = match pages.table.is_empty() {
        true => Value::Null,
        false => {
            let file = format!("{name}-table.ktx2");
            let extent = [*columns, (pages.table.len() / *columns as usize) as u32];
            folder.write(file.clone(), &encode_ktx2(Ktx2Format::R32Sfloat, extent, &[pages.table_bytes()], &[])?)?;
            json!(file)
        }
    };
    Ok(json!({ "name": name, "dimensions": dimensions, "columns": columns, "table": table, "pages": files }))
}

fn page_bytes(page: &Page) -> Result<Vec<u8>> {
    let format = if page.wide { Ktx2Format::R16g16b16a16Sfloat } else { Ktx2Format::R8g8b8a8Snorm };
    encode_ktx2(format, page.extent, &[page.bytes()], &[])
}

/// Writes the light from outside for each minute: a row of the radiances of all patches of the sky, then the irradiance of the sun, then the
/// direction towards it. Rows begin and end with the last minutes that have light.
fn moments(folder: &mut Folder<'_>, (day, steps): (&Course, &Steps), weather: Weather) -> Result<Value> {
    let count = (day.length() / f64::from(STEP)).ceil() as u32 + 1;
    let rows = rows(day, steps, weather, count)?;
    let dark = |row: &Vec<[f32; 3]>| row[..row.len() - 1].iter().flatten().all(|value| *value == 0.0);
    let first = rows.iter().position(|row| !dark(row)).unwrap_or(0);
    let last = rows.iter().rposition(|row| !dark(row)).unwrap_or(0);
    let rows = &rows[first..=last];
    let half = |value: f32| f16::from_f32(value.min(f16::MAX.to_f32())).to_le_bytes();
    let bytes = rows.iter().flatten().flat_map(|[r, g, b]| [*r, *g, *b, 1.0].map(half)).flatten().collect();
    let columns = rows[0].len() as u32;
    let file = "moments.ktx2";
    let extent = [columns, rows.len() as u32];
    folder.write(file.into(), &encode_ktx2(Ktx2Format::R16g16b16a16Sfloat, extent, &[bytes], &[])?)?;
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
fn rows(day: &Course, steps: &Steps, weather: Weather, count: u32) -> Result<Vec<Vec<[f32; 3]>>> {
    let row = |minute: u32| {
        let moment = Moment::new(day, steps, f64::from(minute * STEP), weather)?;
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
