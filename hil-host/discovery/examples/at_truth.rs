use discovery::{diagnose, fit, prepare, problem, read, vehicle};
use discovery::problem::{State, tolerance_of, CALIBRATION};
fn main() {
    let dir = std::env::args().nth(1).unwrap();
    for name in std::env::args().skip(2) {
        let case = std::path::PathBuf::from(&dir).join(&name);
        let truth: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(format!("{dir}/truth/{name}.json")).unwrap()).unwrap();
        let v = vehicle::read(&case.join("vehicle.json")).unwrap();
        let f = read::flight(&case).unwrap();
        let p = prepare::prepare(&f, &v);
        let mut notes = vec![];
        let check = diagnose::check_segments(&v, &p, &mut notes);
        let (pr, null) = diagnose::prepared_problem(&f, &v, &p, &check, &mut notes).unwrap();
        let s = &truth["scatter"];
        let keys = ["cd0_relative","lift_slope_relative","lift_quadratic_relative","trim_volume_cc","ballast_gain_relative","pitch_zero_rad","hull_compressibility_relative","hull_thermal_expansion_relative","added_mass_surge","added_mass_heave"];
        let mut st = State::nominal();
        for (i,k) in keys.iter().enumerate() { st.calibration[i] = s[*k].as_f64().unwrap() / tolerance_of(&v, i) ; }
        st.calibration[10] = truth["speed_scale_error"].as_f64().unwrap_or(0.0)/tolerance_of(&v,10);
        let _ = CALIBRATION;
        for e in truth["effects"].as_array().unwrap() {
            let n = e["name"].as_str().unwrap();
            if let Some(ef) = hydro::effects::by_name(n) { if n != "internal_wave" { st.effects.push(fit::start_at(ef, e["value"].as_f64().unwrap())); } }
        }
        println!("{name} {} {} {:?}", truth["site"], truth["wing"], truth["effects"]);
        println!("  colour {} {}  used rms {} s {} beyond {:?} brink {}", truth["background"]["rms_m_s"], truth["background"]["colour"], pr.colour.rms_m_s, pr.colour.correlation_s, pr.beyond, pr.brink_rows());
        let show = |label: &str, st: &State| {
            let m = pr.model(st);
            print!("  {label}: ");
            let mut tot = 0.0; let mut nn = 0;
            for k in 0..pr.runs.len() {
                let (r, d) = pr.range(k);
                let x: f64 = pr.data[r.start..r.start+d].iter().zip(&m[r.start..r.start+d]).map(|(a,b)| (a-b).powi(2)).sum();
                let y: f64 = pr.data[r.start+d..r.end].iter().zip(&m[r.start+d..r.end]).map(|(a,b)| (a-b).powi(2)).sum();
                tot += x + y; nn += r.len();
                let t = pr.track(pr.runs[k], st);
                let mx = t.alpha_rad.iter().enumerate().filter(|(i,_)| pr.runs[k].used[*i]).filter(|(_,a)| a.abs() > 0.35).count();
                print!(" {}:{:.2}", pr.runs[k].segment, x / d as f64);
                if r.len() > d { print!("/{:.2}", y / (r.len()-d) as f64); }
                if mx > 0 { print!("[{mx}/{}]", pr.runs[k].used.iter().filter(|u| **u).count()); }
            }
            println!("  all {tot:.0} of {nn}");
        };
        show("null   ", &null.state);
        show("truth  ", &st);
        let j = fit::Jacobian::new(&pr, &st);
        let ft = fit::fit(&pr, &j, &st, 0.01, fit::Effort { iterations: 8, renew: false });
        show("refit  ", &ft.state);
        println!("   chi2 null {:.1} refit {:.1}  size {:?} z {:.2?}", null.chi2, ft.chi2, ft.state.effects.iter().map(|a| a.values[0]).collect::<Vec<_>>(), ft.state.calibration);
        println!("   truth z {:.2?}", st.calibration);
        if std::env::var("SEARCH").is_ok() {
            let found = discovery::search::search(&pr, None, &|_, _| {});
            show("snull  ", &found.null.state);
            println!("   search null chi2 {:.1} z {:.2?}", found.null.chi2, found.null.state.calibration);
            for c in found.candidates.iter().take(6) { println!("     {:?} odds {:.1} chi2 {:.1} {:?} z {:.2?}", c.effects, c.log_odds, c.fit.chi2, c.fit.state.effects.iter().map(|a| a.values[0]).collect::<Vec<_>>(), c.fit.state.calibration); }
        }
    }
}
