mod corpus;
mod judge;
use planisphere::camera::Region;
#[test]
fn timing() {
    for case in corpus::corpus() {
        let now = std::time::Instant::now();
        let judge = judge::Judge::new(&case.scene, &case.view);
        let r = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| judge.ids(Region::whole(case.view.image))));
        let t = now.elapsed().as_secs_f64() * 1e3;
        match r {
            Ok(ids) => {
                let hit = ids.iter().filter(|&&i| i >= 0).count();
                let mut u = ids.clone();
                u.sort();
                u.dedup();
                println!(
                    "{t:8.1} ms {:7}/{:7} px {:5} kinds {:9} pairs {:?} | {}",
                    hit,
                    ids.len(),
                    u.len(),
                    case.scene.len() * ids.len(),
                    judge.effort,
                    case.name
                );
            }
            Err(_) => println!("PANIC {t} {}", case.name),
        }
    }
}
