//! Development probe: residuals by run of one case at nominal and at the calibration fit.
use discovery::{fit, prepare, problem, read, vehicle};
fn main() {
    let case = std::path::PathBuf::from(std::env::args().nth(1).expect("case"));
    let v = vehicle::read(&case.join("vehicle.json")).expect("vehicle");
    let f = read::flight(&case).expect("flight");
    let p = prepare::prepare(&f, &v);
    let pr = problem::Problem::new(&p, &v, |s| v.fit_segments.contains(&s));
    let s = problem::State::nominal();
    if let Some(k) = std::env::args().nth(2) {
        trace(
            &pr,
            k.parse().unwrap(),
            std::env::args().nth(3).unwrap().parse().unwrap(),
            std::env::args().nth(4).unwrap().parse().unwrap(),
        );
        return;
    }
    let jac = fit::Jacobian::new(&pr, &s);
    let nf = fit::fit(&pr, &jac, &s, 0.01, fit::Effort { iterations: 4, renew: false });
    println!("{:?}\n{:?}", v.background, nf.state.calibration);
    for (label, st) in [("nominal", &s), ("fit", &nf.state)] {
        let m = pr.model(st);
        for k in 0..pr.runs.len() {
            let run = pr.runs[k];
            let (range, n) = pr.range(k);
            let d: Vec<f64> = range.map(|i| pr.data[i] - m[i]).collect();
            let t = pr.track(run, st);
            let rows = pr.rows(k);
            let amax = rows.iter().map(|&r| t.alpha_rad[r].abs()).fold(0.0, f64::max);
            let mut al: Vec<f64> = rows.iter().map(|&r| t.alpha_rad[r].abs()).collect();
            al.sort_by(f64::total_cmp);
            let mut th: Vec<f64> =
                rows.iter().map(|&r| run.inputs[((run.time_s[r] - run.time_s[0]) / 1.0) as usize].sensed.pitch_rad.abs()).collect();
            th.sort_by(f64::total_cmp);
            let ms = d[..n].iter().map(|x| x * x).sum::<f64>() / n as f64;
            let worst = (0..n).max_by(|&a, &b| d[a].abs().total_cmp(&d[b].abs())).unwrap_or(0);
            println!(
                "{label} seg {} n {n} ms {ms:.2} alpha med {:.3} max {amax:.3} pitch med {:.3} worst {:.1} at t {:.0} z {:.1} alpha {:.3} rest {:?}",
                run.segment,
                al[n / 2],
                th[n / 2],
                d[worst],
                run.time_s[rows[worst]] - run.time_s[0],
                run.depth_m[rows[worst]],
                t.alpha_rad[rows[worst]],
                &d[d.len() - 4..]
            );
        }
    }
}
#[allow(dead_code)]
fn trace(pr: &problem::Problem, k: usize, from: f64, to: f64) {
    let run = pr.runs[k];
    let t = pr.track(run, &problem::State::nominal());
    for i in 1..run.time_s.len() {
        let tt = run.time_s[i] - run.time_s[0];
        if tt < from || tt > to {
            continue;
        }
        let j = (tt / 1.0) as usize;
        let inp = &run.inputs[j];
        println!(
            "{tt:7.1} z {:7.2} wobs {:7.3} wmod {:7.3} th {:6.3} q {:7.4} b {:6.1} rho {:.3} T {:.2} roll {:.2} U {:.3} al {:.3} used {}",
            run.depth_m[i],
            (run.depth_m[i] - run.depth_m[i - 1]) / (run.time_s[i] - run.time_s[i - 1]),
            (t.depth_m[i] - t.depth_m[i - 1]) / (run.time_s[i] - run.time_s[i - 1]),
            inp.sensed.pitch_rad,
            inp.pitch_rate_rad_s,
            inp.sensed.ballast_m3 * 1e6,
            inp.sensed.density_kg_m3,
            inp.sensed.temperature_degc,
            inp.roll_rad,
            t.speed_m_s[i],
            t.alpha_rad[i],
            run.used[i]
        );
    }
}
