//! The principal components of a bake: images, coefficients, and the table that names them.

use lucerna::{
    Result,
    image::{Ktx2Format, encode_ktx2},
    techniques::daylight::{
        Calendar, Kind, Stored, Weather,
        export::{self, Page, Pages},
    },
};
use serde_json::{Value, json};

use super::{
    Folder, Lamps,
    moments::{self, OneDay},
};
use crate::program;

/// What the numbers of lightmaps are.
pub const UNIT: &str = "irradiance in W/m2, linear Rec. 709; reflected radiance = albedo / pi * irradiance";

/// Writes the images and gives the document that describes them. `uv_set`: the lightmap's texture coordinates; a cube has none.
///
/// # Errors
/// `Output`; `Usage` if the weather is impossible.
pub fn write(
    folder: &mut Folder<'_>,
    stored: &Stored,
    days: &[OneDay],
    weather: Weather,
    lamps: &Lamps,
    uv_set: Option<u32>,
) -> Result<Value> {
    let plan = &stored.plan;
    let layers = export::layers(stored, lamps.is_there());
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
    let mut scene = json!({ "name": plan.scene, "file": "scene.glb" });
    if let Some(uv_set) = uv_set {
        scene["texcoord"] = json!(uv_set);
    }
    let mut document = json!({
        "format": "lucerna daylight export",
        "version": 1,
        "generator": format!("lucerna {}", program::VERSION),
        "scene": scene,
        "unit": UNIT,
        "width": plan.extent[0],
        "height": plan.extent[1],
        "sources": "sources.ktx2",
        "weather": {
            "turbidity": weather.turbidity(),
            "ground_albedo": weather.ground_albedo(),
            "overcast": weather.overcast(),
        },
        "tolerance": plan.settings.tolerance,
        "layers": described,
        "tiles": tiles,
    });
    let mut of_days = Vec::new();
    for day in days {
        of_days.push(one_day(folder, stored, day, weather, lamps, days.len() > 1)?);
    }
    // Readers of one day find the first one.
    for (key, value) in of_days[0].as_object().into_iter().flatten() {
        document[key] = value.clone();
    }
    if lamps.is_there() {
        document["lamps"] = lamps.listed();
    }
    if let Kind::Cube { position, .. } = &plan.receivers {
        document["kind"] = json!("cube");
        document["position"] = json!(position);
    }
    if days.len() > 1 {
        document["days"] = json!(of_days);
    }
    // Readers of version 1 know lightmaps of one day under sun and sky.
    if lamps.is_there() || days.len() > 1 || uv_set.is_none() || days[0].span.is_some() {
        document["version"] = json!(2);
    }
    Ok(document)
}

/// What the table says of a day.
fn one_day(
    folder: &mut Folder<'_>,
    stored: &Stored,
    day: &OneDay,
    weather: Weather,
    lamps: &Lamps,
    several: bool,
) -> Result<Value> {
    let Calendar { zone, latitude, longitude, north, .. } = &stored.plan.calendar;
    let mut out = json!({
        "day": {
            "date": day.date,
            "zone": zone,
            "latitude": latitude,
            "longitude": longitude,
            "north": north,
            "seconds": day.course.length(),
        },
        "times": day.times(&stored.plan).collect::<Vec<_>>(),
        "nights": day.steps.nights().collect::<Vec<_>>(),
        "moments": moments::write(folder, day, weather, several)?,
    });
    if several {
        out["first_column"] = json!(day.first_column(&stored.plan));
    }
    if let Some(span) = day.span {
        out["span"] = json!(span);
    }
    if lamps.is_there() {
        out["switches"] = lamps.switches(&day.course)?;
    }
    Ok(out)
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
