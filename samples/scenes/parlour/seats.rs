//! Sofa, armchair and dining chair. Who sits on them looks to +Z.

use super::super::kit::{Geometry, Model, circle, cuboid, curve, lathe, pillow, profile, puffed, rounded_box, sweep};
use super::Palette;
use glam::{Vec2, Vec3, vec2, vec3};

/// A cushion of full extents `size`, swollen by up to `amount` along each axis.
fn cushion(size: Vec3, amount: Vec3) -> Geometry {
    puffed(rounded_box(size, 0.32 * size.min_element(), (2, 3)), 0.5 * size, amount)
}

/// A sine or cosine of a rounder or squarer outline than a circle's.
fn soft(c: f32, power: f32) -> f32 {
    c.signum() * c.abs().powf(power)
}

/// A turned foot, `high` to its top.
fn foot(high: f32) -> Geometry {
    let points =
        [(0.0, 0.0), (0.016, 0.0), (0.02, 0.01), (0.032, 0.5), (0.034, 0.7), (0.026, 0.78), (0.026, 1.0), (0.0, 1.0)];
    lathe(&points.map(|(r, y)| vec2(r, y * high)), 12, 40.0)
}

/// A sofa for three with rolled arms, 2.1 m wide.
pub(super) fn sofa(palette: &Palette) -> Model {
    let mut cloth = rounded_box(vec3(1.86, 0.24, 0.82), 0.03, (2, 1)).at(0.0, 0.25, 0.0);
    let back = rounded_box(vec3(1.86, 0.62, 0.19), 0.08, (3, 2));
    cloth.append(&back.turned_x(-9.0).at(0.0, 0.56, -0.34));
    for side in [-1.0f32, 1.0] {
        let x = side * 0.95;
        cloth.append(&rounded_box(vec3(0.17, 0.44, 0.86), 0.05, (2, 1)).at(x, 0.36, 0.0));
        cloth.append(&rounded_box(vec3(0.25, 0.2, 0.9), 0.0999, (3, 1)).at(x + side * 0.02, 0.57, 0.0));
    }
    for i in -1..=1 {
        let x = 0.578 * i as f32;
        cloth.append(&cushion(vec3(0.572, 0.17, 0.68), vec3(0.0, 0.03, 0.012)).at(x, 0.44, 0.085));
        let soft = cushion(vec3(0.565, 0.46, 0.17), vec3(0.0, 0.015, 0.05));
        cloth.append(&soft.turned_x(-13.0).at(x, 0.72, -0.2));
    }
    let mut feet = Geometry::default();
    for (x, z) in [(-0.86, 0.34), (0.86, 0.34), (-0.86, -0.34), (0.86, -0.34)] {
        feet.append(&foot(0.14).at(x, 0.0, z));
    }
    let mut model = Model::of(palette.sofa, cloth);
    model.add(palette.wood, feet);
    model
}

/// A scatter cushion of a colour, its middle at the origin.
pub(super) fn scatter(palette: &Palette, color: Vec3) -> Model {
    Model::of(palette.pillow, pillow(vec2(0.44, 0.44), 0.17, 10).colored(color))
}

/// An armchair whose back runs around into its arms.
pub(super) fn armchair(palette: &Palette) -> Model {
    let mut cloth = rounded_box(vec3(0.62, 0.2, 0.64), 0.04, (2, 1)).at(0.0, 0.27, 0.02);
    cloth.append(&cushion(vec3(0.55, 0.16, 0.62), vec3(0.0, 0.035, 0.015)).at(0.0, 0.44, 0.06));
    // From the left hand around the back to the right hand.
    let (wide, deep) = (0.35, 0.4);
    let mut way: Vec<Vec3> = (0..6).map(|i| vec3(-wide, 0.4, 0.36 - 0.06 * i as f32)).collect();
    way.extend((0..=24).map(|i| {
        let (sin, cos) = (std::f32::consts::PI * i as f32 / 24.0).sin_cos();
        vec3(-wide * cos, 0.4, -deep * sin.max(0.0).powf(0.9))
    }));
    way.extend((0..6).map(|i| vec3(wide, 0.4, 0.06 + 0.06 * i as f32)));
    let section: Vec<Vec2> =
        circle(1.0, 16).iter().map(|p| vec2(0.068 * soft(p.x, 0.7), 0.25 * soft(p.y, 0.45))).collect();
    let last = way.len() - 1;
    let rounded = |k: usize| [0.6, 0.86, 0.97].get(k.min(last - k)).copied().unwrap_or(1.0);
    let shell = sweep(&way, &section, true, rounded).displaced(|p| {
        // The back stands higher than the arms, and leans.
        let t = ((0.16 - p.z) / 0.46).clamp(0.0, 1.0);
        let raised = (p.y - 0.3).max(0.0) * 0.95 * t * t * (3.0 - 2.0 * t);
        p + vec3(0.0, raised, -0.28 * raised)
    });
    cloth.append(&shell);
    let soft = cushion(vec3(0.5, 0.42, 0.13), vec3(0.0, 0.015, 0.045));
    cloth.append(&soft.turned_x(-14.0).at(0.0, 0.68, -0.24));
    let mut feet = Geometry::default();
    for (x, z) in [(-0.25, 0.26), (0.25, 0.26), (-0.22, -0.24), (0.22, -0.24)] {
        feet.append(&foot(0.18).at(x, 0.0, z));
    }
    let mut model = Model::of(palette.armchair, cloth);
    model.add(palette.wood, feet);
    model
}

/// A chair for the dining table: turned legs, a padded seat, a back of slats.
pub(super) fn chair(palette: &Palette) -> Model {
    let mut wood = Geometry::default();
    let leg = profile(
        &[
            (0.0, 0.0),
            (0.012, 0.0),
            (0.016, 0.02),
            (0.02, 0.2),
            (0.017, 0.25),
            (0.024, 0.28),
            (0.019, 0.31),
            (0.022, 0.42),
        ],
        1,
    );
    let mut leg: Vec<Vec2> = leg;
    leg.push(vec2(0.0, 0.42));
    let bar: Vec<Vec2> = circle(0.016, 8);
    for side in [-1.0f32, 1.0] {
        wood.append(&lathe(&leg, 10, 50.0).at(side * 0.19, 0.0, 0.18));
        let post = [
            vec3(side * 0.185, 0.0, -0.235),
            vec3(side * 0.18, 0.22, -0.195),
            vec3(side * 0.18, 0.44, -0.185),
            vec3(side * 0.185, 0.7, -0.205),
            vec3(side * 0.19, 0.97, -0.27),
        ];
        wood.append(&sweep(&curve(&post, 3), &bar, true, |_| 1.0));
        wood.append(&cuboid(0.02, 0.05, 0.34).at(side * 0.183, 0.4, 0.0));
        wood.append(&sweep(
            &[vec3(side * 0.188, 0.17, 0.175), vec3(side * 0.181, 0.17, -0.2)],
            &circle(0.009, 8),
            true,
            |_| 1.0,
        ));
    }
    wood.append(&cuboid(0.34, 0.05, 0.02).at(0.0, 0.4, 0.183));
    wood.append(&cuboid(0.34, 0.05, 0.02).at(0.0, 0.4, -0.185));
    wood.append(&sweep(&[vec3(-0.186, 0.17, -0.01), vec3(0.186, 0.17, -0.01)], &circle(0.009, 8), true, |_| 1.0));
    // Rails and slats of the back bow a little.
    let bow = |x: f32| 0.03 - 0.75 * x * x;
    let mut rail = |half: f32, (y, z): (f32, f32), high: f32| {
        let way: Vec<Vec3> = (0..=6).map(|i| half * (i as f32 / 3.0 - 1.0)).map(|x| vec3(x, y, z - bow(x))).collect();
        let section = circle(1.0, 8).iter().map(|p| vec2(0.011 * p.x, 0.5 * high * soft(p.y, 0.6))).collect::<Vec<_>>();
        wood.append(&sweep(&way, &section, true, |_| 1.0));
    };
    rail(0.21, (0.945, -0.25), 0.09);
    rail(0.18, (0.57, -0.175), 0.05);
    for i in -1..=1 {
        let x = 0.085 * i as f32;
        let slat =
            [vec3(x, 0.56, -0.176 - bow(x)), vec3(x, 0.74, -0.2 - bow(x)), vec3(x * 1.05, 0.93, -0.245 - bow(x))];
        let flat: Vec<Vec2> = circle(1.0, 8).iter().map(|p| vec2(0.02 * p.x, 0.006 * p.y)).collect();
        wood.append(&sweep(&curve(&slat, 3), &flat, true, |_| 1.0));
    }
    let seat =
        puffed(rounded_box(vec3(0.44, 0.06, 0.43), 0.024, (2, 3)), vec3(0.22, 0.03, 0.215), vec3(0.0, 0.02, 0.0));
    let mut model = Model::of(palette.oak, wood);
    model.add(palette.seat, seat.at(0.0, 0.45, 0.005));
    model
}
