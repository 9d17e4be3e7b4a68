//! Bakes in shards: the same bytes, whichever process computes which unit.

use crate::prt_lab::{sampled, small};
use crate::prt_light::room;
use lucerna::{
    bake::{self, End, Options, Shard, Store},
    gpu::testing::with_gpu,
    techniques::prt::{Bakery, Baking, Stored, units},
};

#[test]
fn one_two_and_five_shards_give_the_same_bytes() {
    with_gpu(|gpu| {
        let scene = room();
        let baking =
            Baking { samples: 800, cluster: 100, directions: 100, visibility: 12, examples: 60, rays: 64, ..small() };
        let (_, found) = sampled(gpu, &scene, &baking).unwrap();
        let mut whole = None;
        for shards in [1, 2, 5] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("room.parts");
            let mut ends = Vec::new();
            // A basis needs the light of all clusters and transfer needs all bases, so shards take three turns.
            for turn in 0..if shards == 1 { 1 } else { 3 } {
                for number in 1..=shards {
                    // Each one knows nothing but the folder; odd turns go backwards.
                    let number = if turn % 2 == 0 { number } else { shards + 1 - number };
                    let job = units::job(&found.plan, &found.samples, "device").unwrap();
                    let store = Store::create(&path, job).unwrap();
                    let mut work = units::Work::new(Bakery::new(gpu, &scene).unwrap(), found.clone()).unwrap();
                    let shard: Shard = format!("{number}/{shards}").parse().unwrap();
                    let options = Options { shard, ..Options::default() };
                    let ran = bake::run(&store, &options, |unit, needed| work.unit(unit, &needed), |_| {}).unwrap();
                    ends.push(matches!(ran.end, End::Done));
                }
            }
            assert!(ends[ends.len() - shards as usize..].iter().all(|done| *done), "{shards}: {ends:?}");
            assert!(shards == 1 || !ends[0], "{shards}: {ends:?}");
            let store = Store::open(&path).unwrap();
            let bytes = Stored::of_parts(&store).unwrap().encode().unwrap();
            assert!(found.plan.clusters.len() > 5 && bytes == *whole.get_or_insert(bytes.clone()), "{shards} shards");
        }
    });
}
