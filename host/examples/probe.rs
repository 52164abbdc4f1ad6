//! Probe.
use std::time::Instant;
use stillpoint::movefile::MoveFile;
use stillpoint::nlp::*;
use stillpoint::plan::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let t0 = Instant::now();
    let mut file = MoveFile::read(&args[1]).unwrap_or_else(|e| panic!("{e}"));
    if args.len() > 3 {
        file.mesh.intervals = args[2].parse().unwrap();
        file.mesh.points = args[3].parse().unwrap();
    }
    println!("rigid {:?}", rigid_duration_s(&file));
    match plan(
        &file,
        &Pounce,
        Box::new(|i, _| {
            if std::env::var("LOG").is_ok() {
                println!("{i:?}");
            }
            true
        }),
    ) {
        Ok(p) => {
            println!(
                "T {} {:?}\n miss {:?} {}\n viol {:?}",
                p.solution.duration_s,
                p.effort,
                p.end_miss,
                p.end_miss.largest(),
                p.largest_violation
            );
            let mut b = vec![0; 20000];
            println!("bytes {}", p.trajectory.encode(&mut b).unwrap().len());
        }
        Err(e) => println!("{e}"),
    }
    println!("{:?}", t0.elapsed());
}
