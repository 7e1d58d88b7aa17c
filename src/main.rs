use decimate::decimate::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let m = decimate::io::read(a[1].as_ref(), None).unwrap();
    let o = Options {
        targets: Targets {
            ratio: Some(a[2].parse().unwrap()),
            ..Default::default()
        },
        tier: match a.get(4).map(|s| s.as_str()) {
            Some("small") => TierChoice::Fixed(decimate::mesh::Tier::Small),
            Some("medium") => TierChoice::Fixed(decimate::mesh::Tier::Medium),
            _ => TierChoice::Fixed(decimate::mesh::Tier::Full),
        },
        check: a.get(5).is_some(),
        ..Default::default()
    };
    let (m, r) = decimate::decimate::decimate(m, &o).unwrap();
    eprintln!("{r:?}");
    decimate::io::write(a[3].as_ref(), &m, &Default::default()).unwrap();
}
