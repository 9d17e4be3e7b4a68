//! Two rows of round columns and the arches they carry.

use super::super::kit::{Geometry, Model, Stage, at, bevel_box, lathe, slab, sweep};
use super::walls::{Arch, Wall};
use super::{BAYS, COLUMN, HALF, Palette, bay, roof::ARCADE_TOP};
use glam::{Vec2, vec2};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Height of a column with its capital, where the arches begin.
const SPRING: f32 = 4.2;
/// Half the width of the stone an arch stands on, and the arcade's thickness.
const PAD: f32 = 0.3;
const THICKNESS: f32 = 0.5;

pub(super) fn arcades(stage: &mut Stage, palette: &Palette) {
    let column = stage.mesh("column", Model::of(palette.stone, column()));
    let into = 0.2;
    let pitch = bay(1) - bay(0);
    let arches: Vec<Arch> = (0..BAYS)
        .map(|i| {
            let middle = into + (i as f32 + 0.5) * pitch;
            Arch { middle, half: 0.5 * pitch - PAD, bottom: SPRING, spring: SPRING }
        })
        .collect();
    let wall = Wall {
        width: 2.0 * (HALF.0 + into),
        base: SPRING,
        thickness: THICKNESS,
        top: &|_, _| ARCADE_TOP,
        kinks: &[],
        arches: &arches,
    };
    let arcade = stage.mesh("arcade", wall.build(palette.plaster, palette.plaster));
    let mut rolls = Geometry::default();
    for arch in &arches {
        rolls.append(&moulding(arch, 0.5 * THICKNESS));
    }
    let rolls = stage.mesh("arch mouldings", Model::of(palette.stone, rolls));
    for (name, side) in [("north", -1.0), ("south", 1.0)] {
        let middle = side * COLUMN;
        stage.place(&format!("{name} arcade"), arcade, at(-HALF.0 - into, 0.0, middle + 0.5 * THICKNESS));
        stage.place(&format!("{name} mouldings"), rolls, at(-HALF.0 - into, 0.0, middle));
        for i in 1..BAYS {
            stage.place(&format!("{name} column {i}"), column, at(bay(i), 0.0, middle));
        }
        for (end, x) in [("west", -HALF.0), ("east", HALF.0)] {
            stage.add(&format!("{name} {end} pier"), Model::of(palette.stone, pier().at(x, 0.0, middle)));
        }
    }
}

/// Half a pier at an end wall, under the arcade's last stone.
fn pier() -> Geometry {
    let mut out = slab([-PAD, -0.1, -0.22], [PAD, SPRING - 0.2, 0.22]);
    out.append(&bevel_box(2.0 * PAD + 0.1, 0.5, 0.56, 0.03).at(0.0, 0.25, 0.0));
    out.append(&bevel_box(2.0 * PAD + 0.02, 0.24, THICKNESS + 0.12, 0.03).at(0.0, SPRING - 0.12, 0.0));
    out
}

/// Roll mouldings that follow an arch on both faces of the arcade.
fn moulding(arch: &Arch, out_by: f32) -> Geometry {
    let radius = arch.half + 0.12;
    let around = Arch { half: radius, bottom: arch.spring, ..*arch };
    let outline = around.outline(22);
    let path: Vec<_> = outline[1..outline.len() - 1].iter().map(|p| p.extend(0.0)).collect();
    let profile: Vec<Vec2> = (0..6).map(|i| Vec2::from_angle(TAU * i as f32 / 6.0) * 0.05).collect();
    let roll = sweep(&path, &profile, true, |_| 1.0);
    let mut both = roll.clone().at(0.0, 0.0, out_by);
    both.append(&roll.at(0.0, 0.0, -out_by));
    both
}

/// A column on y = 0: plinth, base of two rolls, shaft with a swelling, capital, slab.
fn column() -> Geometry {
    let radius = 0.27f32;
    // Points of a roll that stands out from `r` by its `reach`, from y to y + 2 `reach`.
    let roll = |r: f32, y: f32, reach: f32| {
        (0..=8).map(move |i| {
            let angle = FRAC_PI_2 * (i as f32 / 4.0 - 1.0);
            vec2(r + reach * angle.cos(), y + reach * (1.0 + angle.sin()))
        })
    };
    let mut profile = vec![vec2(0.0, 0.16), vec2(radius + 0.08, 0.16)];
    profile.extend(roll(radius + 0.05, 0.16, 0.07));
    profile.extend([vec2(radius + 0.03, 0.32), vec2(radius + 0.02, 0.35)]);
    profile.extend(roll(radius + 0.02, 0.37, 0.04));
    profile.push(vec2(radius + 0.005, 0.47));
    // The shaft swells by a centimetre and gets thinner by three.
    let (foot, neck) = (0.5, SPRING - 0.75);
    profile.extend((0..=12).map(|i| {
        let t = i as f32 / 12.0;
        vec2(radius + 0.012 * (t * std::f32::consts::PI).sin() - 0.03 * t * t, foot + (neck - foot) * t)
    }));
    profile.extend(roll(radius - 0.03, neck + 0.01, 0.035));
    // The bell of the capital.
    let bell = SPRING - 0.22;
    profile.extend((0..=8).map(|i| {
        let t = i as f32 / 8.0;
        vec2(radius - 0.03 + 0.13 * (1.0 - (1.0 - t * t).max(0.0).sqrt()), neck + 0.09 + (bell - neck - 0.13) * t)
    }));
    profile.extend(roll(radius + 0.08, bell - 0.04, 0.03));
    profile.push(vec2(0.0, bell + 0.02));
    let mut out = lathe(&profile, 30, 38.0);
    out.append(&bevel_box(2.0 * (radius + 0.13), 0.24, 2.0 * (radius + 0.13), 0.02).at(0.0, 0.05, 0.0));
    out.append(&bevel_box(2.0 * PAD + 0.06, 0.11, THICKNESS + 0.16, 0.02).at(0.0, bell + 0.055, 0.0));
    out.append(&bevel_box(2.0 * PAD + 0.14, 0.1, THICKNESS + 0.24, 0.03).at(0.0, SPRING - 0.055, 0.0));
    out
}
