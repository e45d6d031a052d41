//! Expressions of a Plan in mathematical notation: one layout, printed as plain text, MathML or LaTeX.
//!
//! p is position, v velocity, u command, Δu its change, θ heading, A an arena, d(i, j) the distance of outlines,
//! C the safety distance, Δt the time step, T the steps of an episode, t time; F_i is a place of formation F, F_{i,j}
//! the distance it wants of neighbours, E(F) its edges, O all obstacles, N_k(i) the k nearest to i; `#{… : …}` counts.
//! Parentheses stand only where the tree would be read otherwise.

pub mod latex;
pub mod mathml;
pub mod text;

use crate::plan::{
    AgentRef, BinaryOp, Binder, Distribution, Expr, FormationId, Function, IndexSet, Measure, Plan, Quantity,
    Reduction, UnaryOp, VarId, World, WorldConstant,
};

/// A formula as it is set.
#[derive(Clone, Debug, PartialEq)]
enum Math {
    Number(String),
    /// A variable; one letter slanted, more upright.
    Name(String),
    /// The name of a function.
    Word(&'static str),
    /// Between two operands.
    Infix(&'static str),
    /// Tight on what follows.
    Mark(&'static str),
    Row(Vec<Math>),
    Sub(Box<Math>, Box<Math>),
    Sup(Box<Math>, Box<Math>),
    Frac(Box<Math>, Box<Math>),
    Root(Box<Math>),
    Fence(&'static str, Box<Math>, &'static str),
    /// Needs parentheses only where everything stands on one line.
    Soft(Box<Math>),
    /// An operator with what it runs over below it, and its body.
    Big(&'static str, Box<Math>, Box<Math>),
    /// then, condition, otherwise
    Cases(Box<[Math; 3]>),
}

/// How tightly a formula holds together.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Open,
    Or,
    And,
    Not,
    Comparison,
    Sum,
    Product,
    Power,
    Atom,
}

fn layout(plan: &Plan, world: &World, expr: &Expr) -> Math {
    let shared = world.shared.iter().flat_map(|shared| [Some(&shared.var), shared.rewarded.as_ref()]);
    let scope = shared.flatten().map(|var| (var.id, var.name.clone())).collect();
    Layout { plan, world, scope }.free(expr)
}

/// `k_c` as k with the subscript c.
fn symbol(name: &str) -> Math {
    match name.split_once('_') {
        Some((base, below)) if !base.is_empty() && !below.is_empty() => {
            subscript(named(base), named(&below.replace('_', ",")))
        }
        _ => named(name),
    }
}

fn named(name: &str) -> Math {
    const GREEK: &[(&str, &str)] = &[
        ("alpha", "α"),
        ("beta", "β"),
        ("gamma", "γ"),
        ("delta", "δ"),
        ("epsilon", "ε"),
        ("theta", "θ"),
        ("kappa", "κ"),
        ("lambda", "λ"),
        ("mu", "μ"),
        ("rho", "ρ"),
        ("sigma", "σ"),
        ("tau", "τ"),
        ("phi", "φ"),
        ("psi", "ψ"),
        ("omega", "ω"),
    ];
    let greek = GREEK.iter().find(|(word, _)| *word == name).map_or(name, |(_, letter)| letter);
    Math::Name(greek.to_owned())
}

fn subscript(base: Math, below: Math) -> Math {
    Math::Sub(Box::new(base), Box::new(below))
}

fn fence(open: &'static str, inner: Math, close: &'static str) -> Math {
    Math::Fence(open, Box::new(inner), close)
}

fn parentheses(inner: Math) -> Math {
    fence("(", inner, ")")
}

fn number(value: f64) -> Math {
    if let Some(turn) = turn(value) {
        return turn;
    }
    let size = value.abs();
    if size == 0.0 || (1e-4..1e7).contains(&size) || !size.is_finite() {
        return Math::Number(format!("{value}").replace('-', "−"));
    }
    let text = format!("{value:e}").replace('-', "−");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let power =
        Math::Sup(Box::new(Math::Number("10".to_owned())), Box::new(Math::Number(exponent.to_owned())));
    match mantissa {
        "1" => power,
        _ => Math::Row(vec![Math::Number(mantissa.to_owned()), Math::Infix("×"), power]),
    }
}

/// π, 2π and the common fractions of π.
fn turn(value: f64) -> Option<Math> {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4, FRAC_PI_6, PI, TAU};
    let pi = || Math::Name("π".to_owned());
    let fraction = |below: &str| Math::Frac(Box::new(pi()), Box::new(Math::Number(below.to_owned())));
    let known = [(FRAC_PI_2, "2"), (FRAC_PI_3, "3"), (FRAC_PI_4, "4"), (FRAC_PI_6, "6")];
    match value {
        PI => Some(pi()),
        TAU => Some(Math::Row(vec![Math::Number("2".to_owned()), pi()])),
        _ => known.iter().find(|(known, _)| *known == value).map(|(_, below)| fraction(below)),
    }
}

struct Layout<'a> {
    plan: &'a Plan,
    world: &'a World,
    /// Index variables in scope and how they are called.
    scope: Vec<(VarId, String)>,
}

impl Layout<'_> {
    fn free(&mut self, expr: &Expr) -> Math {
        self.set(expr).0
    }

    /// In parentheses if it holds together less than wanted.
    fn at_least(&mut self, level: Level, expr: &Expr) -> Math {
        let (math, own) = self.set(expr);
        match math {
            // A fraction as a factor is clear on two lines.
            Math::Frac(..) if level <= Level::Power => Math::Soft(Box::new(math)),
            math if own < level => parentheses(math),
            math => math,
        }
    }

    fn set(&mut self, expr: &Expr) -> (Math, Level) {
        let atom = |math| (math, Level::Atom);
        match expr {
            Expr::Number(value) => {
                let level = if *value < 0.0 { Level::Product } else { Level::Atom };
                (number(*value), level)
            }
            Expr::Truth(true) => atom(Math::Word("true")),
            Expr::Truth(false) => atom(Math::Word("false")),
            Expr::Param(id) => atom(self.plan.params.get(*id).map_or(Math::Word("?"), |it| symbol(&it.name))),
            Expr::World(WorldConstant::Dt) => atom(Math::Row(vec![Math::Word("Δ"), named("t")])),
            Expr::World(WorldConstant::Safety) => atom(named("C")),
            Expr::World(WorldConstant::Horizon) => atom(named("T")),
            Expr::Time => atom(named("t")),
            Expr::State(index) => atom(subscript(named("s"), Math::Number(index.to_string()))),
            Expr::SlotNumber => atom(named("k")),
            Expr::SlotCount => atom(named("n")),
            Expr::Vector(x, y) => atom(self.called(None, &[x.as_ref(), y.as_ref()])),
            Expr::Unary(UnaryOp::Neg, of) => {
                let of = self.at_least(Level::Product, of);
                (Math::Row(vec![Math::Mark("−"), of]), Level::Product)
            }
            Expr::Unary(UnaryOp::Not, of) => {
                if let Expr::Same(a, b) = **of {
                    let row = vec![self.agent(a), Math::Infix("≠"), self.agent(b)];
                    return (Math::Row(row), Level::Comparison);
                }
                let of = self.at_least(Level::Atom, of);
                (Math::Row(vec![Math::Mark("¬"), of]), Level::Not)
            }
            Expr::Binary(op, left, right) => self.binary(*op, left, right),
            Expr::Call(function, arguments) => self.call(*function, arguments),
            Expr::If { condition, then, otherwise } => {
                let cases = [self.free(then), self.free(condition), self.free(otherwise)];
                (Math::Cases(Box::new(cases)), Level::Open)
            }
            Expr::Agent(Quantity::Outside, agent) => {
                let (position, arena) = (subscript(named("p"), self.agent(*agent)), named("A"));
                let arena = subscript(arena, self.agent(*agent));
                (Math::Row(vec![position, Math::Infix("∉"), arena]), Level::Comparison)
            }
            Expr::Agent(quantity, agent) => {
                let letter = match quantity {
                    Quantity::Velocity => "v",
                    Quantity::Heading => "θ",
                    Quantity::Position | Quantity::Outside => "p",
                    Quantity::Command => "u",
                    Quantity::CommandChange => {
                        let command = subscript(named("u"), self.agent(*agent));
                        return atom(Math::Row(vec![Math::Word("Δ"), command]));
                    }
                };
                atom(subscript(named(letter), self.agent(*agent)))
            }
            Expr::Slot(formation, agent) => {
                atom(subscript(self.formation_name(*formation), self.agent(*agent)))
            }
            Expr::Rest(formation, a, b) => {
                let below = Math::Row(vec![self.agent(*a), Math::Mark(","), self.agent(*b)]);
                atom(subscript(self.formation_name(*formation), below))
            }
            Expr::Clearance(a, b) => {
                let between = Math::Row(vec![self.agent(*a), Math::Mark(", "), self.agent(*b)]);
                atom(Math::Row(vec![named("d"), parentheses(between)]))
            }
            Expr::Same(a, b) => {
                (Math::Row(vec![self.agent(*a), Math::Infix("="), self.agent(*b)]), Level::Comparison)
            }
            Expr::MemberNumber(agent) => {
                atom(Math::Row(vec![Math::Word("number"), parentheses(self.agent(*agent))]))
            }
            Expr::Element(list, number) => {
                let list = self.called(None, &list.iter().collect::<Vec<_>>());
                atom(subscript(list, self.free(number)))
            }
            Expr::Track(track, time) => {
                let name = self.plan.tracks.get(*track).map_or(Math::Word("?"), |it| symbol(&it.name));
                atom(Math::Row(vec![name, self.called(None, &[time.as_ref()])]))
            }
            Expr::Measured(measure) => atom(match measure {
                Measure::Term(term) => {
                    self.world.reward.get(*term).map_or(Math::Word("?"), |it| symbol(&it.name))
                }
                Measure::Reward => Math::Word("reward"),
                Measure::Error => Math::Word("error"),
                Measure::Ended(end) => {
                    self.world.ends.get(*end).map_or(Math::Word("?"), |it| symbol(&it.name))
                }
            }),
            Expr::Reduce { op, vars, over, filter, body } => {
                self.reduce(*op, vars, over, filter.as_deref(), body)
            }
            Expr::Draw { distribution, .. } => atom(match distribution {
                Distribution::Uniform { low, high } => {
                    self.called(Some("uniform"), &[low.as_ref(), high.as_ref()])
                }
                Distribution::Normal { mean, deviation } => {
                    self.called(Some("normal"), &[mean.as_ref(), deviation.as_ref()])
                }
                Distribution::UnitDisc => self.called(Some("disc"), &[]),
            }),
        }
    }

    fn binary(&mut self, op: BinaryOp, left: &Expr, right: &Expr) -> (Math, Level) {
        let (symbol, level) = match op {
            BinaryOp::Add => ("+", Level::Sum),
            BinaryOp::Sub => ("−", Level::Sum),
            BinaryOp::Mul => ("⋅", Level::Product),
            BinaryOp::Div => {
                let (top, bottom) = (self.set(left), self.set(right));
                let soft = |(math, level): (Math, Level), wanted| match level < wanted {
                    true => Box::new(Math::Soft(Box::new(math))),
                    false => Box::new(math),
                };
                return (Math::Frac(soft(top, Level::Product), soft(bottom, Level::Power)), Level::Product);
            }
            BinaryOp::Pow => {
                let (base, exponent) = (self.at_least(Level::Atom, left), self.set(right));
                let exponent = match exponent.1 < Level::Atom {
                    true => Math::Soft(Box::new(exponent.0)),
                    false => exponent.0,
                };
                return (Math::Sup(Box::new(base), Box::new(exponent)), Level::Power);
            }
            BinaryOp::Less => ("<", Level::Comparison),
            BinaryOp::LessEq => ("≤", Level::Comparison),
            BinaryOp::Greater => (">", Level::Comparison),
            BinaryOp::GreaterEq => ("≥", Level::Comparison),
            BinaryOp::Equal => ("=", Level::Comparison),
            BinaryOp::NotEqual => ("≠", Level::Comparison),
            BinaryOp::And => ("∧", Level::And),
            BinaryOp::Or => ("∨", Level::Or),
        };
        let tighter = match level {
            Level::Or => Level::And,
            Level::And => Level::Not,
            Level::Comparison => Level::Sum,
            Level::Sum => Level::Product,
            _ => Level::Power,
        };
        let left = match level {
            // What follows would be taken for a part of the body.
            _ if level > Level::Sum && open_ended(left) => parentheses(self.free(left)),
            Level::Comparison => self.at_least(Level::Sum, left),
            _ => self.at_least(level, left),
        };
        let right = match right {
            Expr::Reduce { op, .. } if is_big(*op) && level <= Level::Product => self.free(right),
            right if leads_with_minus(right) && level >= Level::Sum => parentheses(self.free(right)),
            right => self.at_least(tighter, right),
        };
        (Math::Row(vec![left, Math::Infix(symbol), right]), level)
    }

    fn call(&mut self, function: Function, arguments: &[Expr]) -> (Math, Level) {
        let mut first = || arguments.first().map_or(Math::Word("?"), |argument| self.free(argument));
        let math = match function {
            Function::Norm => fence("‖", first(), "‖"),
            Function::Abs => fence("|", first(), "|"),
            Function::Floor => fence("⌊", first(), "⌋"),
            Function::Sqrt => Math::Root(Box::new(first())),
            Function::X | Function::Y => {
                let axis = named(if function == Function::X { "x" } else { "y" });
                match first() {
                    Math::Sub(base, below) => {
                        Math::Sub(base, Box::new(Math::Row(vec![*below, Math::Mark(","), axis])))
                    }
                    math @ (Math::Name(_) | Math::Fence(..)) => subscript(math, axis),
                    math => subscript(parentheses(math), axis),
                }
            }
            Function::Dot | Function::Cross => {
                let symbol = if function == Function::Dot { "⋅" } else { "×" };
                let (Some(left), Some(right)) = (arguments.first(), arguments.get(1)) else {
                    return (Math::Word("?"), Level::Atom);
                };
                let (left, right) = (self.at_least(Level::Power, left), self.at_least(Level::Power, right));
                return (Math::Row(vec![left, Math::Infix(symbol), right]), Level::Product);
            }
            _ => self.called(Some(word(function)), &arguments.iter().collect::<Vec<_>>()),
        };
        (math, Level::Atom)
    }

    /// `name(arguments)`
    fn called(&mut self, name: Option<&'static str>, arguments: &[&Expr]) -> Math {
        let mut row = Vec::new();
        for argument in arguments {
            if !row.is_empty() {
                row.push(Math::Mark(", "));
            }
            row.push(self.free(argument));
        }
        let arguments = parentheses(Math::Row(row));
        match name {
            Some(name) => Math::Row(vec![Math::Word(name), arguments]),
            None => arguments,
        }
    }

    fn agent(&self, agent: AgentRef) -> Math {
        match agent {
            AgentRef::Var(id) => {
                let name = self.scope.iter().find(|(known, _)| *known == id);
                name.map_or(Math::Word("?"), |(_, name)| named(name))
            }
            AgentRef::Member => named("i"),
            AgentRef::Fixed(id) => {
                let mut first = 0;
                for group in &self.world.groups {
                    match id.checked_sub(first) {
                        Some(0) if group.size == 1 => return named(&group.name),
                        Some(member) if member < group.size => {
                            let number = Math::Number((member + 1).to_string());
                            return Math::Row(vec![named(&group.name), Math::Mark(","), number]);
                        }
                        _ => first += group.size,
                    }
                }
                Math::Word("?")
            }
        }
    }

    fn reduce(
        &mut self,
        op: Reduction,
        vars: &[Binder],
        over: &IndexSet,
        filter: Option<&Expr>,
        body: &Expr,
    ) -> (Math, Level) {
        let outer = self.scope.len();
        for var in vars {
            let mut name = var.name.clone();
            while self.scope.iter().any(|(_, taken)| *taken == name) {
                name.push('′');
            }
            self.scope.push((var.id, name));
        }
        let between = if matches!(over, IndexSet::Edges(_)) { Math::Mark(", ") } else { Math::Infix("<") };
        let mut below = Vec::new();
        for (_, name) in self.scope.iter().skip(outer) {
            if !below.is_empty() {
                below.push(between.clone());
            }
            below.push(named(name));
        }
        below.extend([Math::Infix("∈"), self.set_name(over)]);
        if let Some(filter) = filter {
            below.extend([Math::Mark(", "), self.free(filter)]);
        }
        let such_that = |below: Vec<Math>, body| Math::Row([below, vec![Math::Infix(":"), body]].concat());
        let result = match op {
            Reduction::Count => (fence("#{", such_that(below, self.free(body)), "}"), Level::Atom),
            Reduction::Any | Reduction::All => {
                let mark = Math::Mark(if op == Reduction::Any { "∃" } else { "∀" });
                // Its body goes on to the right, so it is never bare in a larger formula.
                (Math::Row(vec![mark, such_that(below, self.free(body))]), Level::Open)
            }
            Reduction::Sum | Reduction::Mean | Reduction::Min | Reduction::Max => {
                let mark = match op {
                    Reduction::Mean => "mean",
                    Reduction::Min => "min",
                    Reduction::Max => "max",
                    _ => "∑",
                };
                let body = self.at_least(Level::Product, body);
                (Math::Big(mark, Box::new(Math::Row(below)), Box::new(body)), Level::Product)
            }
        };
        self.scope.truncate(outer);
        result
    }

    fn set_name(&self, set: &IndexSet) -> Math {
        match set {
            IndexSet::All => Math::Word("all"),
            IndexSet::Group(id) => self.world.groups.get(*id).map_or(Math::Word("?"), |it| named(&it.name)),
            IndexSet::Pairs(of) => self.set_name(of),
            IndexSet::Obstacles => named("O"),
            IndexSet::Edges(formation) => {
                Math::Row(vec![named("E"), parentheses(self.formation_name(*formation))])
            }
            IndexSet::Nearest { count, to, among } => {
                let nearest = subscript(named("N"), Math::Number(count.to_string()));
                let to = Math::Row(vec![self.agent(*to), Math::Mark("; "), self.set_name(among)]);
                Math::Row(vec![nearest, parentheses(to)])
            }
        }
    }

    fn formation_name(&self, formation: FormationId) -> Math {
        self.world.formations.get(formation).map_or(Math::Word("?"), |it| symbol(&it.name))
    }
}

/// Whether what comes after an expression could be taken for a part of it.
fn open_ended(expr: &Expr) -> bool {
    match expr {
        Expr::Reduce { op, .. } => is_big(*op),
        Expr::Unary(_, of) | Expr::Binary(BinaryOp::Mul, _, of) => open_ended(of),
        _ => false,
    }
}

fn is_big(op: Reduction) -> bool {
    !matches!(op, Reduction::Count | Reduction::Any | Reduction::All)
}

fn leads_with_minus(expr: &Expr) -> bool {
    match expr {
        Expr::Number(value) => *value < 0.0,
        Expr::Unary(UnaryOp::Neg, _) => true,
        Expr::Binary(BinaryOp::Mul, left, _) => leads_with_minus(left),
        _ => false,
    }
}

fn word(function: Function) -> &'static str {
    match function {
        Function::Rotate => "rotate",
        Function::Unit => "unit",
        Function::Sin => "sin",
        Function::Cos => "cos",
        Function::Tan => "tan",
        Function::Atan2 => "atan2",
        Function::Exp => "exp",
        Function::Ln => "ln",
        Function::Tanh => "tanh",
        Function::Mod => "mod",
        Function::Sign => "sgn",
        Function::Min => "min",
        Function::Max => "max",
        Function::Clamp => "clamp",
        // These have a notation of their own.
        Function::Norm => "norm",
        Function::Abs => "abs",
        Function::X => "x",
        Function::Y => "y",
        Function::Dot => "dot",
        Function::Cross => "cross",
        Function::Sqrt => "sqrt",
        Function::Floor => "floor",
    }
}

#[cfg(test)]
mod tests;
