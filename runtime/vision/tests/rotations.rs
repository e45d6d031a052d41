//! Rotations against SciPy (fixtures/make_rotations.py), and cameras by hand.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

use mpgx_vision::{CameraConfig, Pose, Quaternion};
use serde::Deserialize;

#[derive(Deserialize)]
struct Case {
    first: [f64; 4],
    second: [f64; 4],
    matrix: [[f64; 3]; 3],
    angle_rad: f64,
    after: [f64; 4],
    share: f64,
    between: [f64; 4],
}

fn quaternion([w, x, y, z]: [f64; 4]) -> Quaternion {
    Quaternion { w, x, y, z }
}

/// Equal as rotations: the sign does not count.
fn near(a: Quaternion, b: Quaternion) -> bool {
    let away = |b: Quaternion| [a.w - b.w, a.x - b.x, a.y - b.y, a.z - b.z].iter().all(|x| x.abs() < 1e-12);
    away(b) || away(b.negated())
}

#[test]
fn rotations_are_those_of_scipy() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("fixtures/rotations.json")).unwrap();
    assert_eq!(cases.len(), 24);
    for Case { first, second, matrix, angle_rad, after, share, between } in cases {
        let (first, second) = (quaternion(first), quaternion(second));
        assert!(near(Quaternion::from_matrix(&matrix), first), "{matrix:?}");
        for (row, wanted) in first.matrix().iter().flatten().zip(matrix.iter().flatten()) {
            assert!((row - wanted).abs() < 1e-14);
        }
        assert!((first.angle_rad(second) - angle_rad).abs() < 1e-12, "{angle_rad}");
        assert!(near(second.after(first), quaternion(after)));
        for (a, b) in [(first, second), (first.negated(), second), (first, second.negated())] {
            assert!(near(a.slerp(b, share), quaternion(between)), "{angle_rad} {share}");
        }
    }
}

/// A third of the way through a right angle about z.
#[test]
fn slerp_by_hand() {
    let quarter = Quaternion { w: FRAC_1_SQRT_2, x: 0.0, y: 0.0, z: FRAC_1_SQRT_2 };
    let third = Quaternion::IDENTITY.slerp(quarter, 1.0 / 3.0);
    assert!(near(third, Quaternion { w: (PI / 12.0).cos(), x: 0.0, y: 0.0, z: (PI / 12.0).sin() }));
    assert!(near(Quaternion::IDENTITY.slerp(quarter, 0.0), Quaternion::IDENTITY));
    assert!(near(Quaternion::IDENTITY.slerp(quarter, 1.0), quarter));
}

#[test]
fn a_camera_looks_where_its_robot_heads() {
    let camera = CameraConfig { tilt_rad: 0.3, height_m: 0.5, ..CameraConfig::default() };
    for heading_rad in [-3.1, -1.0, 0.0, 0.5, FRAC_PI_2, 3.0] {
        let robot = Pose { x_m: 1.0, y_m: -2.0, heading_rad };
        let pose = camera.pose(robot);
        assert!((pose.planar().heading_rad - heading_rad).abs() < 1e-12);
        assert_eq!((pose.position_m, pose.planar().x_m), ([1.0, -2.0, 0.5], 1.0));
        let [x, y, z] = pose.quaternion.rotate([0.0, 0.0, 1.0]);
        let wanted = [0.3f64.cos() * heading_rad.cos(), 0.3f64.cos() * heading_rad.sin(), -0.3f64.sin()];
        assert!([x, y, z].iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12));
        // Right is on the floor's plane, down has the floor below.
        assert!(pose.quaternion.rotate([1.0, 0.0, 0.0])[2].abs() < 1e-12);
        assert!(pose.quaternion.rotate([0.0, 1.0, 0.0])[2] < -0.9);
    }
}

/// 96 px over 90°: a focal length of 48 px. A point 1 m ahead and 0.5 m to the left and above is 24 px off the middle.
#[test]
fn a_pinhole_by_hand() {
    let camera = CameraConfig { fov_rad: FRAC_PI_2, tilt_rad: 0.0, height_m: 0.4, ..CameraConfig::default() };
    let pose = camera.pose(Pose { x_m: 0.0, y_m: 0.0, heading_rad: 0.0 });
    let [u, v] = camera.project(&pose, [1.0, 0.5, 0.9]).unwrap();
    assert!((u - 24.0).abs() < 1e-9 && (v - 24.0).abs() < 1e-9, "{u} {v}");
    assert_eq!(camera.project(&pose, [-1.0, 0.0, 0.4]), None);
}
