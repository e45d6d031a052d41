//! The picture of a scenario: well-formed, inert, the same for equal input, with its marks where they belong.

#![allow(clippy::unwrap_used)]

use mpgx_lang::plan::{Constraint, Control, Graph, Group, Plan, Solid};
use mpgx_lang::source::NoFiles;
use mpgx_report::picture::{self, Frame, Landscape, Moment};
use roxmltree::Document;

const SOURCE: &str = include_str!("../../../scenarios/square_unison.scn");
const HOSTILE: &str = "\"'><script>alert(1)</script>&amp;\u{1}]]>";

fn plan() -> Plan {
    mpgx_lang::compile("square_unison.scn", SOURCE.into(), &[], &NoFiles).plan.unwrap()
}

/// The leader in the middle, two followers in their places, the third 0.5 m to the right of its own.
fn moment(plan: &Plan) -> Moment<'_> {
    let places = vec![[-0.4, 0.0], [-0.4, -0.4], [0.0, -0.4]];
    Moment {
        world: &plan.world,
        positions_m: vec![[0.0, 0.0], places[0], places[1], [0.5, -0.4]],
        headings: vec![None, Some(0.0), Some(std::f64::consts::FRAC_PI_2), Some(3.0)],
        ways_m: vec![vec![[0.0, 0.0], [0.5, 0.5], [1.0, 0.0]], vec![], vec![], vec![]],
        places_m: vec![places],
        lengths_m: vec![vec![]],
    }
}

/// A cone about a position; it fails right of x = 2.
fn cone(moment: &Moment, [x, y]: [f64; 2]) -> Landscape {
    let area = picture::extent(moment);
    let (columns, rows) = picture::grid(area, 2000);
    let nodes = picture::nodes(area, columns, rows);
    Landscape {
        agent: 1,
        name: "reward".into(),
        dimension: "length".into(),
        columns,
        values: nodes.iter().map(|p| -(p[0] - x).hypot(p[1] - y)).collect(),
        failed: nodes.iter().map(|p| p[0] > 2.0).collect(),
    }
}

fn draw(plan: &Plan, change: impl FnOnce(&mut Moment, &mut Landscape)) -> String {
    let mut moment = moment(plan);
    let mut land = cone(&moment, [1.0, -0.5]);
    change(&mut moment, &mut land);
    let svg = picture::svg(plan, &moment, &land);
    let document = Document::parse(&svg).unwrap_or_else(|error| panic!("{error}: {svg}"));
    for node in document.descendants() {
        for attribute in node.attributes() {
            let value = attribute.value();
            assert!(!value.contains("NaN") && !value.contains("inf"), "{value}");
        }
    }
    svg
}

fn texts(svg: &str) -> Vec<String> {
    let document = Document::parse(svg).unwrap();
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    texts.map(|node| node.text().unwrap_or_default().to_string()).collect()
}

#[test]
fn the_picture_says_what_it_shows() {
    let plan = plan();
    let svg = draw(&plan, |_, _| ());
    let texts = texts(&svg);
    for text in [
        "Reward over the position of follower[1]",
        "F: square",
        "leader: point, moves by random_velocity; arena",
        "follower 1–3: unicycle, learned; arena",
        "safety distance 0.1\u{202f}m, true to scale",
        "the episode fails: crash or lost",
        "where follower[1] is",
        "0.40\u{202f}m",
        "0.57\u{202f}m",
    ] {
        assert!(
            texts.iter().any(|found| found.replace("0.100", "0.1") == text),
            "{text} is not in {texts:?}"
        );
    }
    let best = texts.iter().find(|text| text.starts_with("greatest reward")).unwrap();
    assert!(best.contains(" at (1.0") || best.contains(" at (0.9"), "{best}");
    assert_eq!(svg, draw(&plan, |_, _| ()));
}

/// 100 points a metre, the origin in the middle of the frame at (200, 200).
#[test]
fn marks_are_where_things_are() {
    let plan = plan();
    let area = mpgx_lang::plan::Area { x_m: (-2.0, 2.0), y_m: (-2.0, 2.0) };
    let frame = Frame { area, left: 0.0, top: 0.0, width: 400.0 };
    let moment = moment(&plan);
    let scene = picture::scene(&moment, &frame);
    assert!(scene.contains("M100 300L300 300L300 100L100 100z"), "arena of the leader: {scene}");
    assert!(scene.contains("M200 240L250 240"), "the third is 50 points right of its place");
    assert!(scene.contains("M247.3 240a2.7 2.7"), "its marker is there");
    assert!(scene.contains("M197.3 240a2.7 2.7"), "its place is hollow there");
    assert!(scene.contains("M160 200L167.2 200"), "the first looks right");
    assert!(scene.contains("M160 240L160 232.8"), "the second looks up");
    assert!(scene.contains("M200 200L250 150L300 200"), "the way of the leader");
}

/// In the landscape a line of the cone is a circle about its top.
#[test]
fn lines_of_a_cone_are_circles() {
    let plan = plan();
    let moment = moment(&plan);
    let area = picture::extent(&moment);
    let frame = Frame { area, left: 0.0, top: 0.0, width: 100.0 * (area.x_m.1 - area.x_m.0) };
    let land = cone(&moment, [0.0, 0.0]);
    let drawn = picture::landscape(&moment, &land, &frame);
    let last =
        drawn.split("<path d=\"").filter(|part| part.contains("stroke-opacity=\".5\"")).last().unwrap();
    let data = last.split('"').next().unwrap();
    let [x, y] = frame.at([0.0, 0.0]);
    let radii: Vec<f64> = data
        .trim_end_matches('z')
        .split(['M', 'L'])
        .filter(|point| !point.is_empty())
        .map(|point| point.split_once(' ').unwrap())
        .map(|(a, b)| (a.parse::<f64>().unwrap() - x).hypot(b.parse::<f64>().unwrap() - y))
        .collect();
    assert!(radii.len() > 8);
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    assert!(radii.iter().all(|radius| (radius - mean).abs() < 2.5), "{radii:?}");
}

#[test]
fn hostile_names_are_text() {
    let mut hostile = plan();
    let before = Document::parse(&draw(&hostile, |_, _| ())).unwrap().descendants().count();
    hostile.name = HOSTILE.into();
    for group in &mut hostile.world.groups {
        group.name = HOSTILE.into();
        group.body.name = HOSTILE.into();
        if let Control::Motion(motion) = &mut group.control {
            motion.name = HOSTILE.into();
        }
    }
    for formation in &mut hostile.world.formations {
        formation.name = HOSTILE.into();
        formation.shape = HOSTILE.into();
    }
    hostile.world.ends.iter_mut().for_each(|end| end.name = HOSTILE.into());
    let svg = draw(&hostile, |_, land| {
        land.name = HOSTILE.into();
        land.dimension = HOSTILE.into();
    });
    assert_eq!(Document::parse(&svg).unwrap().descendants().count(), before, "no element more");
    assert!(!svg.contains("<script"));
}

/// Nothing that a Plan or a simulation could hold breaks the picture.
#[test]
fn odd_worlds_have_pictures_too() {
    let usual = plan();
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300, -1e300] {
        draw(&usual, |_, land| land.values.fill(value));
        draw(&usual, |_, land| land.values[7] = value);
        draw(&usual, |moment, _| moment.positions_m[2] = [value, value]);
    }
    draw(&usual, |_, land| land.values.clear());
    draw(&usual, |_, land| land.columns = 0);
    draw(&usual, |moment, _| {
        moment.positions_m.clear();
        moment.places_m.clear();
        moment.ways_m.clear();
    });
    let constant = draw(&usual, |_, land| land.values.fill(-2.0));
    assert!(texts(&constant).iter().any(|text| text.contains("at many positions")));
    let mut empty = usual.clone();
    empty.world = Default::default();
    draw(&empty, |moment, _| moment.positions_m.clear());
}

#[test]
fn obstacles_have_their_outlines() {
    let mut plan = plan();
    let place = mpgx_lang::plan::Place::default;
    let solids = [
        Solid::Disc { radius_m: 0.5 },
        Solid::Segment { to_m: (1.0, 0.0) },
        Solid::Polygon { corners_m: vec![(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)] },
    ];
    for solid in solids {
        let group =
            Group { name: "rock".into(), size: 1, solid: Some(solid), at: place(), ..Group::default() };
        plan.world.groups.push(group);
    }
    let mut moment = moment(&plan);
    moment.positions_m.extend([[1.0, 1.0]; 3]);
    let area = mpgx_lang::plan::Area { x_m: (-2.0, 2.0), y_m: (-2.0, 2.0) };
    let scene = picture::scene(&moment, &Frame { area, left: 0.0, top: 0.0, width: 400.0 });
    assert!(scene.contains("M250 100a50 50"), "the disc");
    assert!(scene.contains("M300 100L400 100\""), "the segment");
    assert!(scene.contains("M300 100L350 100L300 50z"), "the triangle");
}

/// A thousand robots: a picture without labels, of bearable size.
#[test]
fn a_large_formation_of_distances_is_drawn() {
    let mut plan = plan();
    plan.world.groups[1].size = 1000;
    let formation = &mut plan.world.formations[0];
    formation.about = None;
    formation.graph = Graph::Ring;
    formation.constraint = Constraint::Distances(Vec::new());
    let mut moment = moment(&plan);
    moment.positions_m = (0..1001).map(|k| [0.001 * f64::from(k), 0.0]).collect();
    moment.headings = vec![None; 1001];
    moment.places_m = vec![vec![]];
    moment.lengths_m = vec![vec![0.1; 1000]];
    let svg = picture::svg(&plan, &moment, &cone(&moment, [0.0, 0.0]));
    Document::parse(&svg).unwrap();
    assert!(svg.len() < 400_000, "{} bytes", svg.len());
}
