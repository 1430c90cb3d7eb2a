//! Development probe: prints the search on one trial directory.
use discovery::{prepare, problem, read, search, vehicle};
fn main() {
    for case in std::env::args().skip(1) {
        let case = std::path::PathBuf::from(case);
        let v = vehicle::read(&case.join("vehicle.json")).expect("vehicle");
        let f = read::flight(&case).expect("flight");
        let t0 = std::time::Instant::now();
        let p = prepare::prepare(&f, &v);
        let t1 = std::time::Instant::now();
        let mut pr = problem::Problem::new(&p, &v, |s| v.fit_segments.contains(&s));
        let s = problem::State::nominal();
        let t2 = std::time::Instant::now();
        let m = pr.model(&s);
        let t3 = std::time::Instant::now();
        let r: Vec<f64> = pr.data.iter().zip(&m).map(|(a, b)| a - b).collect();
        for k in 0..pr.runs.len() {
            let (range, n) = pr.range(k);
            let d = &r[range.clone()][..n];
            let ms = d.iter().map(|x| x * x).sum::<f64>() / n as f64;
            let ac = d.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64 / ms;
            let big = d.iter().filter(|x| x.abs() > 4.5).count();
            println!("run {k} n {n} ms {ms:.3} ac1 {ac:.3} big {big} rest {:?}", &r[range][n..].iter().rev().take(4).collect::<Vec<_>>());
        }
        let jac = discovery::fit::Jacobian::new(&pr, &s);
        let nf = discovery::fit::fit(&pr, &jac, &s, 0.01, discovery::fit::Effort { iterations: 2, renew: false });
        let dropped = pr.drop_outliers(&nf.residual, 5.0);
        println!("prep {:?} sim+whiten {:?} N {} dropped {dropped}", t1 - t0, t3 - t2, pr.data.len());
        let t4 = std::time::Instant::now();
        let found = search::search(&pr, &|_, _| {});
        println!(
            "search {:?} null chi2 {:.1} z {:?}",
            t4.elapsed(),
            found.null.chi2,
            found.null.state.calibration.map(|z| (z * 100.0).round() / 100.0)
        );
        for c in found.candidates.iter().take(12) {
            let v: Vec<_> = c.fit.state.effects.iter().map(|a| a.values[0]).collect();
            println!(
                "{:30} odds {:8.2} gain {:8.2} {:?} sig {:?} {:?}",
                c.effects.join("+"),
                c.log_odds,
                c.gain,
                v,
                c.fit.sigma,
                c.fit.state.wave.as_ref().map(|w| (w.period_s, w.mode, &w.amplitude_m_s))
            );
        }
    }
}
