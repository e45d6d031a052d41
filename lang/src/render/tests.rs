use super::*;
use crate::plan::{Area, Constraint, Control, Extern, Formation, Frame, Graph, Group, Param, Place, Slots};

fn world() -> (Plan, World) {
    let group = |name: &str, size| Group {
        name: name.to_owned(),
        size,
        body: Extern { name: "point".to_owned(), settings: Default::default() },
        arena: Some(Area { x_m: (-1.0, 1.0), y_m: (-1.0, 1.0) }),
        speed_mps: (-1.0, 1.0),
        control: Control::Learned,
        ..Group::default()
    };
    let formation = Formation {
        name: "F".to_owned(),
        shape: "square".to_owned(),
        group: 1,
        about: Some(0),
        constraint: Constraint::Displacements { slots: Slots::List(Vec::new()), frame: Frame::Global },
        graph: Graph::Star,
        at: Place::default(),
    };
    let world = World {
        dt_s: 0.1,
        horizon: 200,
        safety_m: 0.1,
        groups: vec![group("leader", 1), group("follower", 3)],
        formations: vec![formation],
        ..World::default()
    };
    let param = |name: &str| Param {
        name: name.to_owned(),
        doc: String::new(),
        value: 1.0,
        dimension: "length".to_owned(),
        ..Param::default()
    };
    let plan = Plan {
        name: "test".to_owned(),
        doc: String::new(),
        params: ["k_c", "side", "sigma", "x<&\"_b"].map(param).to_vec(),
        world: world.clone(),
        seeds: 10,
        ..Plan::default()
    };
    (plan, world)
}

fn text(expr: &Expr) -> String {
    let (plan, world) = world();
    text::expr(&plan, &world, expr)
}

fn latex(expr: &Expr) -> String {
    let (plan, world) = world();
    latex::expr(&plan, &world, expr)
}

fn mathml(expr: &Expr) -> String {
    let (plan, world) = world();
    mathml::expr(&plan, &world, expr)
}

const A: Expr = Expr::Param(0);
const B: Expr = Expr::Param(1);

fn binary(op: BinaryOp, left: Expr, right: Expr) -> Expr {
    Expr::Binary(op, Box::new(left), Box::new(right))
}

fn neg(of: Expr) -> Expr {
    Expr::Unary(UnaryOp::Neg, Box::new(of))
}

fn position(id: VarId) -> Expr {
    Expr::Agent(Quantity::Position, AgentRef::Var(id))
}

fn binders(names: &[(VarId, &str)]) -> Vec<Binder> {
    names.iter().map(|(id, name)| Binder { id: *id, name: (*name).to_owned() }).collect()
}

fn sum(id: VarId, body: Expr) -> Expr {
    let vars = binders(&[(id, "i")]);
    Expr::Reduce { op: Reduction::Sum, vars, over: IndexSet::Group(1), filter: None, body: Box::new(body) }
}

fn gap() -> Expr {
    let slot = Expr::Slot(0, AgentRef::Var(0));
    neg(sum(0, Expr::Call(Function::Norm, vec![binary(BinaryOp::Sub, position(0), slot)])))
}

fn crash() -> Expr {
    let apart = Expr::Call(Function::Norm, vec![binary(BinaryOp::Sub, position(0), position(1))]);
    let count = Expr::Reduce {
        op: Reduction::Count,
        vars: binders(&[(0, "i"), (1, "j")]),
        over: IndexSet::Pairs(Box::new(IndexSet::All)),
        filter: None,
        body: Box::new(binary(BinaryOp::Less, apart, Expr::World(WorldConstant::Safety))),
    };
    binary(BinaryOp::Mul, neg(A), count)
}

#[test]
fn the_terms_of_the_paper_look_like_the_paper() {
    assert_eq!(text(&gap()), "−∑_{i ∈ follower} ‖p_i − F_i‖");
    assert_eq!(text(&crash()), "−k_c ⋅ #{i < j ∈ all : ‖p_i − p_j‖ < C}");
    assert_eq!(latex(&gap()), "-\\sum_{i \\in \\mathrm{follower}} \\left\\lVert p_{i} - F_{i}\\right\\rVert");
    assert_eq!(
        latex(&crash()),
        "-k_{c} \\cdot \\#\\left\\{i < j \\in \\operatorname{all} \\mid \\left\\lVert p_{i} - p_{j}\\right\\rVert < C\\right\\}"
    );
    assert!(mathml(&gap()).contains(
        "<munder><mo movablelimits=\"false\">∑</mo><mrow><mi>i</mi><mo>∈</mo><mi>follower</mi></mrow></munder>"
    ));
}

#[test]
fn parentheses_stand_only_where_needed() {
    let (add, sub, mul, div, pow) =
        (BinaryOp::Add, BinaryOp::Sub, BinaryOp::Mul, BinaryOp::Div, BinaryOp::Pow);
    let cases = [
        (binary(add, binary(mul, A, B), B), "k_c ⋅ side + side"),
        (binary(mul, binary(add, A, B), B), "(k_c + side) ⋅ side"),
        (binary(sub, A, binary(sub, A, B)), "k_c − (k_c − side)"),
        (binary(sub, binary(sub, A, B), B), "k_c − side − side"),
        (binary(add, A, neg(B)), "k_c + (−side)"),
        (binary(mul, A, neg(B)), "k_c ⋅ (−side)"),
        (neg(binary(add, A, B)), "−(k_c + side)"),
        (binary(pow, neg(A), Expr::Number(2.0)), "(−k_c)^2"),
        (neg(binary(pow, A, Expr::Number(2.0))), "−k_c^2"),
        (binary(pow, A, binary(div, Expr::Number(1.0), Expr::Number(2.0))), "k_c^(1 / 2)"),
        (binary(div, binary(add, A, B), binary(mul, A, B)), "(k_c + side) / (k_c ⋅ side)"),
        (binary(mul, A, binary(div, A, B)), "k_c ⋅ (k_c / side)"),
        (binary(div, binary(div, A, B), B), "k_c / side / side"),
        (binary(mul, sum(0, A), B), "(∑_{i ∈ follower} k_c) ⋅ side"),
        (binary(mul, B, sum(0, A)), "side ⋅ ∑_{i ∈ follower} k_c"),
        (binary(add, sum(0, binary(mul, A, B)), B), "∑_{i ∈ follower} k_c ⋅ side + side"),
        (sum(0, binary(add, A, B)), "∑_{i ∈ follower} (k_c + side)"),
        (binary(BinaryOp::And, binary(BinaryOp::Or, A, B), B), "(k_c ∨ side) ∧ side"),
        (Expr::Unary(UnaryOp::Not, Box::new(binary(BinaryOp::Less, A, B))), "¬(k_c < side)"),
        (binary(add, A, Expr::Number(-0.5)), "k_c + (−0.5)"),
    ];
    for (expr, expected) in cases {
        assert_eq!(text(&expr), expected);
    }
}

#[test]
fn fractions_need_no_parentheses_on_two_lines() {
    let expr = binary(BinaryOp::Div, binary(BinaryOp::Add, A, B), B);
    assert_eq!(latex(&expr), "\\frac{k_{c} + \\mathrm{side}}{\\mathrm{side}}");
    assert!(!mathml(&expr).contains('('));
}

#[test]
fn names_keep_apart_what_is_apart() {
    let inner = sum(7, binary(BinaryOp::Sub, position(0), position(7)));
    assert_eq!(text(&sum(0, inner)), "∑_{i ∈ follower} ∑_{i′ ∈ follower} (p_i − p_i′)");
    assert_eq!(text(&Expr::Agent(Quantity::Outside, AgentRef::Fixed(0))), "p_leader ∉ A_leader");
    assert_eq!(text(&Expr::Agent(Quantity::Velocity, AgentRef::Fixed(2))), "v_{follower,2}");
    let x = Expr::Call(Function::X, vec![Expr::Agent(Quantity::Position, AgentRef::Fixed(0))]);
    assert_eq!(text(&x), "p_{leader,x}");
    assert_eq!(text(&Expr::Param(2)), "σ");
}

#[test]
fn quantifiers_end_where_their_parentheses_end() {
    let far = binary(BinaryOp::Less, A, B);
    let any = |body: Expr| Expr::Reduce {
        op: Reduction::Any,
        vars: binders(&[(0, "i")]),
        over: IndexSet::All,
        filter: None,
        body: Box::new(body),
    };
    let inside = any(binary(BinaryOp::Or, far.clone(), far.clone()));
    assert_eq!(text(&inside), "∃i ∈ all : k_c < side ∨ k_c < side");
    let outside = binary(BinaryOp::Or, any(far.clone()), far);
    assert_eq!(text(&outside), "(∃i ∈ all : k_c < side) ∨ k_c < side");
}

#[test]
fn numbers_are_short() {
    for (value, expected) in [
        (0.5, "0.5"),
        (-2.0, "−2"),
        (3e-9, "3 × 10^{−9}"),
        (1e9, "10^9"),
        (std::f64::consts::PI, "π"),
        (std::f64::consts::TAU, "2π"),
        (std::f64::consts::FRAC_PI_2, "π / 2"),
        (std::f64::consts::FRAC_PI_3, "π / 3"),
        (std::f64::consts::FRAC_PI_4, "π / 4"),
        (std::f64::consts::FRAC_PI_6, "π / 6"),
        (0.0, "0"),
    ] {
        assert_eq!(text(&Expr::Number(value)), expected);
    }
}

#[test]
fn markup_in_names_is_escaped() {
    let markup = mathml(&Expr::Param(3));
    assert!(markup.contains("x&lt;&amp;&quot;"), "{markup}");
    let condition = binary(BinaryOp::Less, A, B);
    let cases = Expr::If { condition: Box::new(condition), then: Box::new(A), otherwise: Box::new(B) };
    assert!(mathml(&cases).contains("&lt;"));
    assert_eq!(text(&cases), "k_c if k_c < side, else side");
}
