//! Sets of agents, and what runs over them.

use super::fits::Wanted;
use super::{Checker, Scope};
use crate::ast::{self, Call, ExprAt, Span, Spanned};
use crate::dim::Dim;
use crate::hir::{Expr, Kind, Over, Set, Type};
use crate::plan::{GroupId, Reduction};
use crate::print::reduction;
use crate::problem::{Code, Problem};
use crate::resolve::{Space, listed};

impl<'a> Checker<'a> {
    /// `sum(i in follower if …) …`
    pub fn reduce(
        &mut self,
        scope: &mut Scope,
        op: &'a Spanned<Reduction>,
        over: &'a ast::Over,
        body: &'a ExprAt,
        at: Span,
    ) -> Expr {
        let depth = scope.locals.len();
        let checked = self.over(scope, over);
        let word = reduction(op.node);
        let truth = matches!(op.node, Reduction::Count | Reduction::Any | Reduction::All);
        let body = if truth {
            self.wanted(scope, body, &Type::Truth, &Wanted::by(format!("what `{word}` is taken of")))
        } else {
            let value = self.expr(scope, body);
            self.any_number(value, &format_args!("what `{word}` is taken of"))
        };
        scope.locals.truncate(depth);
        let Some(over) = checked.filter(|_| !body.is_poison()) else { return Expr::poison(at) };
        let type_ = match op.node {
            Reduction::Count => Type::Number(Dim::none()),
            Reduction::Any | Reduction::All => Type::Truth,
            _ => body.type_.clone(),
        };
        self.make(Kind::Reduce { op: op.node, over, body: Box::new(body) }, type_, at)
    }

    /// `i in set if filter`. The variables stay in the scope; whoever calls takes them out.
    pub fn over(&mut self, scope: &mut Scope, over: &'a ast::Over) -> Option<Over> {
        let set = self.set(scope, &over.set);
        let group = set.as_ref().and_then(|set| self.group_of(set));
        let mut vars = Vec::new();
        for name in &over.vars {
            let id = self.next_var;
            self.next_var += 1;
            let type_ = if set.is_some() { Type::Agent(group) } else { Type::Poison };
            scope.add(&name.node, Kind::Var(id), type_);
            vars.push((id, name.node.clone()));
        }
        let wanted = if matches!(set, Some(Set::Pairs(_) | Set::Edges(_))) { 2 } else { 1 };
        if let (Some(_), [first, ..]) = (&set, over.vars.as_slice())
            && vars.len() != wanted
        {
            let last = over.vars.last().unwrap_or(first);
            let text = self.sources.text(over.set.span).to_owned();
            let problem = Problem::error(
                &WRONG_VARIABLES,
                match wanted {
                    2 if matches!(set, Some(Set::Edges(_))) => "an edge has two ends".to_owned(),
                    2 => "a pair has two members".to_owned(),
                    _ => format!("`{text}` gives one agent at a time"),
                },
            );
            self.report(problem.at(first.span.to(last.span), format!("{} here", vars.len())).help(
                match wanted {
                    2 => format!("write `i, j in {text}`"),
                    _ => format!("write `i in {text}`, or `i, j in pairs({text})`"),
                },
            ));
            return None;
        }
        if let [a, b] = over.vars.as_slice()
            && a.node == b.node
        {
            let problem = Problem::error(&WRONG_VARIABLES, format!("both members are called `{}`", a.node));
            self.report(problem.at(b.span, "again here").with(a.span, "first here"));
        }
        let filter = match &over.filter {
            Some(filter) => {
                let filter = self.wanted(scope, filter, &Type::Truth, &Wanted::by("a filter"));
                (!filter.is_poison()).then_some(Some(Box::new(filter)))?
            }
            None => None,
        };
        Some(Over { vars, set: set?, filter })
    }

    /// The group that all members of a set belong to, if that is known.
    fn group_of(&self, set: &Set) -> Option<GroupId> {
        match set {
            Set::Group(group) => Some(*group),
            Set::Pairs(of) => self.group_of(of),
            Set::Nearest { among, .. } => self.group_of(among),
            Set::Members(of) => match of.kind {
                Kind::Formation(id) => self.hir.world.formations.get(id).map(|formation| formation.group),
                _ => None,
            },
            Set::All | Set::Obstacles | Set::Argument(_) | Set::Edges(_) => None,
        }
    }

    pub fn set(&mut self, scope: &mut Scope, at: &'a ExprAt) -> Option<Set> {
        match &at.node {
            ast::Expr::Name(name) => return self.set_named(scope, name, at),
            ast::Expr::Call(call) => match call.name.node.as_str() {
                "pairs" => return self.pairs(scope, call, at.span),
                "edges" | "members" => return self.of_formation(scope, call, at.span),
                "nearest" => return self.nearest(scope, call, at.span),
                _ => {}
            },
            _ => {}
        }
        self.no_set(at.span);
        None
    }

    fn set_named(&mut self, scope: &mut Scope, name: &str, at: &'a ExprAt) -> Option<Set> {
        match scope.local(name) {
            Some((Kind::Group(set), _)) => return Some(set),
            Some((_, Type::Poison)) => return None,
            Some((_, Type::Formation)) => {
                let problem =
                    Problem::error(&UNKNOWN_SET, format!("`{name}` is a formation")).at(at.span, "");
                self.report(problem.help(format!("run over `members({name})` or `edges({name})`")));
                return None;
            }
            Some(_) => {
                self.no_set(at.span);
                return None;
            }
            None => {}
        }
        match name {
            "all" => return Some(Set::All),
            "obstacles" => return Some(Set::Obstacles),
            _ => {}
        }
        if let Some(group) = self.group_named(scope, at) {
            return Some(Set::Group(group));
        }
        if self.program.is_unknown(scope.module, Space::Value, name) {
            return None;
        }
        if let Some(entry) = self.program.find(scope.module, Space::Value, name) {
            match self.ids.formations.contains_key(&entry.id) {
                true => {
                    let problem =
                        Problem::error(&UNKNOWN_SET, format!("`{name}` is a formation")).at(at.span, "");
                    self.report(problem.help(format!("run over `members({name})` or `edges({name})`")));
                }
                false => self.no_set(at.span),
            }
            return None;
        }
        let groups = || self.hir.world.groups.iter().map(|group| group.name.as_str());
        let problem = Problem::error(&UNKNOWN_SET, format!("there is no group `{name}`")).at(at.span, "");
        let help = match self.meant(name, groups().chain(["all", "obstacles"])) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("sets are {}", listed(groups().chain(["all", "pairs(all)"]))),
        };
        self.report(problem.help(help));
        None
    }

    fn no_set(&mut self, at: Span) {
        let groups = self.hir.world.groups.iter().map(|group| group.name.as_str());
        let problem = Problem::error(&UNKNOWN_SET, "this is no set of agents")
            .at(at, "")
            .help(format!("sets are {}", listed(groups.chain(["all", "pairs(all)"]))));
        self.report(problem);
    }

    fn pairs(&mut self, scope: &mut Scope, call: &'a Call, at: Span) -> Option<Set> {
        if let [argument] = call.args.as_slice()
            && argument.name.is_none()
        {
            let set = self.set(scope, &argument.value)?;
            if !matches!(set, Set::Pairs(_) | Set::Edges(_) | Set::Nearest { .. }) {
                return Some(Set::Pairs(Box::new(set)));
            }
        }
        let problem = Problem::error(&UNKNOWN_SET, "`pairs` is taken of one group").at(at, "");
        self.report(problem.help("write `pairs(all)` or `pairs(follower)`"));
        None
    }

    /// `edges(F)`, `members(F)`
    fn of_formation(&mut self, scope: &mut Scope, call: &'a Call, at: Span) -> Option<Set> {
        let name = &call.name.node;
        let [argument] = call.args.as_slice() else {
            let problem = Problem::error(&UNKNOWN_SET, format!("`{name}` is taken of one formation"));
            self.report(problem.at(at, "").help(format!("write for example `{name}(F)`")));
            return None;
        };
        let why = Wanted::by(format!("what `{name}` is taken of"));
        let formation = self.wanted(scope, &argument.value, &Type::Formation, &why);
        if formation.is_poison() {
            return None;
        }
        Some(match name.as_str() {
            "edges" => Set::Edges(Box::new(formation)),
            _ => Set::Members(Box::new(formation)),
        })
    }

    /// `nearest(2, i, follower)`
    fn nearest(&mut self, scope: &mut Scope, call: &'a Call, at: Span) -> Option<Set> {
        let [count, to, among] = call.args.as_slice() else {
            let problem = Problem::error(&UNKNOWN_SET, "`nearest` takes a number, an agent and a set");
            self.report(problem.at(at, "").help("write for example `nearest(2, i, follower)`"));
            return None;
        };
        let why = Wanted::by("the number of the nearest");
        let count = self.wanted(scope, &count.value, &Type::Count, &why);
        let number = self.whole(&count, &"the number of the nearest", 1.0);
        let to = self.agent_of(scope, "nearest", &to.value, to.value.span);
        let among = self.set(scope, &among.value)?;
        if let Set::Pairs(_) | Set::Edges(_) | Set::Nearest { .. } = among {
            let problem = Problem::error(&UNKNOWN_SET, "`nearest` chooses single agents");
            self.report(problem.at(at, "").help("write for example `nearest(2, i, follower)`"));
            return None;
        }
        if to.is_poison() {
            return None;
        }
        let type_ = Type::Number(Dim::none());
        let count = self.make(Kind::Number(number? as f64), type_, count.span);
        Some(Set::Nearest { count: Box::new(count), to: Box::new(to), among: Box::new(among) })
    }
}

pub const WRONG_VARIABLES: Code = Code {
    name: "wrong-variables",
    explain: "\
A group gives one agent at a time, pairs give two.

    sum(i in pairs(all)) …          // wrong
    sum(i, j in pairs(all)) …       // right: each pair once",
};

pub const UNKNOWN_SET: Code = Code {
    name: "unknown-set",
    explain: "\
After `in` stands a set: `all`, a group, or `pairs(…)` of one of these.

    sum(i in followers) …           // wrong if the group is called follower
    sum(i in follower) …            // right",
};
