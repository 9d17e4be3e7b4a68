//! MTL text to named lists of values.

use super::parse::{number, numbers, without_comment};
use crate::{Error, Result, scene::folder::shorten};

/// A material as the file states it. `None`: not stated.
#[derive(Clone, Debug, Default)]
pub struct Mtl {
    pub name: String,
    pub diffuse: Option<[f32; 3]>,
    pub specular: Option<[f32; 3]>,
    pub emissive: Option<[f32; 3]>,
    /// Colour of transmitted light.
    pub filter: Option<[f32; 3]>,
    /// Exponent of the highlight.
    pub shininess: Option<f32>,
    /// 1 is opaque.
    pub opacity: Option<f32>,
    pub refraction: Option<f32>,
    pub illumination: Option<u32>,
    pub roughness: Option<f32>,
    pub metallic: Option<f32>,
    pub diffuse_map: Option<Map>,
    pub emissive_map: Option<Map>,
    pub bump_map: Option<Map>,
    pub normal_map: Option<Map>,
    pub opacity_map: Option<Map>,
    /// Keywords that are not read.
    pub ignored: Vec<String>,
}

/// A texture with its options.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    pub file: String,
    pub scale: [f32; 2],
    pub offset: [f32; 2],
    /// `-bm`, the height of bumps.
    pub bumps: f32,
    pub clamp: bool,
}

/// Reads MTL text.
pub fn parse(text: &str) -> Result<Vec<Mtl>> {
    let mut out: Vec<Mtl> = Vec::new();
    for (number, line) in text.split('\n').enumerate() {
        let line = without_comment(line);
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if keyword == "newmtl" {
            out.push(Mtl { name: rest.to_owned(), ..Mtl::default() });
        } else if let (Some(mtl), false) = (out.last_mut(), keyword.is_empty()) {
            statement(mtl, keyword, rest).map_err(|error| error.at(format!("line {}", number + 1)))?;
        }
    }
    Ok(out)
}

fn statement(mtl: &mut Mtl, keyword: &str, rest: &str) -> Result<()> {
    match keyword {
        "Kd" => mtl.diffuse = color(rest)?,
        "Ks" => mtl.specular = color(rest)?,
        "Ke" => mtl.emissive = color(rest)?,
        "Tf" => mtl.filter = color(rest)?,
        "Ns" => mtl.shininess = Some(scalar(rest)?),
        "Ni" => mtl.refraction = Some(scalar(rest)?),
        "d" => mtl.opacity = Some(scalar(rest.trim_start_matches("-halo").trim_start())?),
        "Tr" => mtl.opacity = Some(1.0 - scalar(rest)?),
        "Pr" => mtl.roughness = Some(scalar(rest)?),
        "Pm" => mtl.metallic = Some(scalar(rest)?),
        "illum" => mtl.illumination = Some(scalar(rest)?.clamp(0.0, 10.0) as u32),
        "map_Kd" => mtl.diffuse_map = map(rest)?,
        "map_Ke" => mtl.emissive_map = map(rest)?,
        "map_d" => mtl.opacity_map = map(rest)?,
        "map_Bump" | "map_bump" | "bump" => mtl.bump_map = map(rest)?,
        "norm" | "map_Kn" => mtl.normal_map = map(rest)?,
        // Ambient light is what the engine computes.
        "Ka" | "map_Ka" | "sharpness" => {}
        other if mtl.ignored.len() < 32 => mtl.ignored.push(shorten(other)),
        _ => {}
    }
    Ok(())
}

fn scalar(rest: &str) -> Result<f32> {
    Ok(numbers::<1>(rest, 1)?.0[0])
}

/// Three numbers, or one for all; other colour spaces are not read.
fn color(rest: &str) -> Result<Option<[f32; 3]>> {
    if rest.starts_with("spectral") || rest.starts_with("xyz") {
        return Ok(None);
    }
    let (mut values, count) = numbers::<3>(rest, 1)?;
    if count < 3 {
        values = [values[0]; 3];
    }
    match values.iter().find(|&&value| value < 0.0) {
        None => Ok(Some(values)),
        Some(value) => Err(Error::input(format!("the colour has {value}, which is negative"))),
    }
}

/// Options, then a file name that may have spaces.
fn map(rest: &str) -> Result<Option<Map>> {
    let mut map = Map { file: String::new(), scale: [1.0; 2], offset: [0.0; 2], bumps: 1.0, clamp: false };
    let mut rest = rest;
    while rest.starts_with('-') {
        let (option, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        rest = after.trim_start();
        // Options take up to so many words; vectors may be shorter, and end where no number is.
        let most = match option {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        let mut values = [None; 3];
        for (i, value) in values.iter_mut().take(most).enumerate() {
            let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            *value = number(word).ok();
            if value.is_none() && (i > 0 || most > 1) {
                break;
            }
            map.clamp |= option == "-clamp" && word == "on";
            rest = after.trim_start();
        }
        match option {
            "-s" => map.scale = [values[0].unwrap_or(1.0), values[1].unwrap_or(1.0)],
            "-o" => map.offset = [values[0].unwrap_or(0.0), values[1].unwrap_or(0.0)],
            "-bm" => map.bumps = values[0].unwrap_or(1.0),
            _ => {}
        }
    }
    map.file = rest.trim().trim_matches('"').to_owned();
    Ok((!map.file.is_empty()).then_some(map))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_comments_and_options() {
        let text = "newmtl a b\r\n Kd 1 0.5 0.25 # red\n Ns 10\nTr 0.25\n\
                    map_Kd -s 2 3 -o .5 -clamp on my wood.png\nbump -bm 0.3 \"b.png\"\nnewmtl c\nKs .5\nwhat 1";
        let materials = parse(text).unwrap();
        assert_eq!(materials.len(), 2);
        let a = &materials[0];
        assert_eq!((a.name.as_str(), a.diffuse, a.shininess), ("a b", Some([1.0, 0.5, 0.25]), Some(10.0)));
        assert_eq!(a.opacity, Some(0.75));
        let map = a.diffuse_map.as_ref().unwrap();
        assert_eq!(
            (map.file.as_str(), map.scale, map.offset, map.clamp),
            ("my wood.png", [2.0, 3.0], [0.5, 0.0], true)
        );
        let bump = a.bump_map.as_ref().unwrap();
        assert_eq!((bump.file.as_str(), bump.bumps), ("b.png", 0.3));
        assert_eq!(
            (materials[1].specular, materials[1].ignored.as_slice()),
            (Some([0.5; 3]), ["what".to_owned()].as_slice())
        );
    }

    #[test]
    fn errors_name_the_line() {
        let error = parse("newmtl a\nKd 1 x 2").unwrap_err();
        assert_eq!(error.to_string(), "line 2: \"x\" is no number");
        assert!(parse("newmtl a\nKd").is_err());
        assert!(parse("newmtl a\nNs nan").is_err());
    }
}
