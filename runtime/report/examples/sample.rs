//! Writes the report of a made-up study: `cargo run -p mpgx-report --example sample -- sample.html`.

#[path = "../tests/sample/mod.rs"]
#[allow(dead_code, clippy::unwrap_used)]
mod sample;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "sample.html".into());
    let mut study = sample::study(10, &["random", "regular"]);
    if let Some(record) = study.records.get_mut("td3-003") {
        sample::fail(record);
    }
    let study = sample::Sample::new(study.plan, study.records);
    let page = mpgx_report::html(&study.input())?;
    println!("{} bytes", page.len());
    Ok(std::fs::write(path, page)?)
}
