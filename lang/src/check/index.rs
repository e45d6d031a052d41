//! What stands before brackets: an agent's quantity, a member, a place, an entry of a list.

use super::fits::Wanted;
use super::{Checker, Scope};
use crate::ast::{self, ExprAt, Item, Span};
use crate::dim::Dim;
use crate::hir::{Expr, Kind, Type};
use crate::plan::{FormationId, GroupId, Quantity};
use crate::problem::{Code, Problem};
use crate::resolve::{ItemId, Space};

impl<'a> Checker<'a> {
    /// A group of one stands for its agent.
    pub fn group_as_agent(&mut self, id: ItemId, name: &str, at: Span) -> Expr {
        let Some(&group) = self.ids.groups.get(&id) else { return Expr::poison(at) };
        match self.hir.world.groups.get(group).map(|group| group.size) {
            Some(1) => self.make(Kind::Fixed(group, 0), Type::Agent(Some(group)), at),
            None | Some(0) => self.unknown_yet(at),
            Some(size) => {
                let problem = Problem::error(
                    &GROUP_AS_AGENT,
                    format!("`{name}` is {size} agents; one is wanted"),
                )
                .at(at, format!("a group of {size}"))
                .help(format!(
                    "run over it, `… for i in {name}` or `sum(i in {name}) …`, or choose one: `{name}[1]`"
                ));
                self.poison(at, problem)
            }
        }
    }

    /// `p[i]`, `v[i]`, `heading[i]`, `F[i]`, `follower[2]`
    pub fn index(&mut self, scope: &mut Scope, of: &'a ExprAt, index: &'a ExprAt, at: Span) -> Expr {
        let ast::Expr::Name(name) = &of.node else {
            let problem = Problem::error(&BAD_INDEX, "only names are followed by `[…]`").at(of.span, "");
            return self.poison(
                at,
                problem.help("`p[i]`, `v[i]`, `heading[i]`, `F[i]` and `follower[1]` are understood"),
            );
        };
        let quantity = match name.as_str() {
            "p" => Some((Quantity::Position, Type::Vector(self.units.base("length")))),
            "v" => Some((Quantity::Velocity, Type::Vector(self.units.base("speed")))),
            "heading" => Some((Quantity::Heading, Type::Number(Dim::none()))),
            "u" => Some((Quantity::Command, Type::Vector(self.units.base("speed")))),
            "du" => Some((Quantity::CommandChange, Type::Vector(self.units.base("speed")))),
            _ => None,
        };
        if let Some((quantity, type_)) = quantity.filter(|_| scope.local(name).is_none()) {
            let agent = self.agent_of(scope, name, index, at);
            if agent.is_poison() {
                return agent;
            }
            return self.make(Kind::Agent(quantity, Box::new(agent)), type_, at);
        }
        if let Some((_, type_)) = scope.local(name) {
            return match type_ {
                Type::Formation => self.place_or_distance(scope, of, name, index, at),
                Type::List(_) => self.element(scope, of, index, at),
                Type::Track => self.on_track(scope, of, index, at),
                Type::Poison => Expr::poison(at),
                _ => self.no_members(name, at),
            };
        }
        let entry = self.find(scope.module, Space::Value, name);
        let item = entry.and_then(|entry| Some((entry, self.program.item(entry.id)?)));
        match item.map(|(entry, item)| (entry, &item.node)) {
            Some((_, Item::Formation(_))) => self.place_or_distance(scope, of, name, index, at),
            Some((_, Item::Recording { .. })) => self.on_track(scope, of, index, at),
            Some((_, Item::Let(_))) => self.element(scope, of, index, at),
            Some((entry, Item::Agents(_) | Item::Obstacles(_))) => match self.ids.groups.get(&entry.id) {
                Some(&group) => self.member_of(scope, group, index, at),
                None => Expr::poison(at),
            },
            // Which `expr` knows how to say or that it was said.
            None | Some((_, Item::Landmarks(_))) => self.expr(scope, of),
            _ => self.no_members(name, at),
        }
    }

    fn no_members(&mut self, name: &str, at: Span) -> Expr {
        let problem = Problem::error(&BAD_INDEX, format!("`{name}` has no members"))
            .at(at, "")
            .help("`p[i]`, `v[i]`, `heading[i]`, a formation, a group and a list are followed by `[…]`");
        self.poison(at, problem)
    }

    /// `corners[2]`: entries are numbered from 1.
    fn element(&mut self, scope: &mut Scope, of: &'a ExprAt, index: &'a ExprAt, at: Span) -> Expr {
        let list = self.expr(scope, of);
        let why = Wanted::by("the number of an entry");
        let number = self.wanted(scope, index, &Type::Number(Dim::none()), &why);
        if list.is_poison() || number.is_poison() {
            return Expr::poison(at);
        }
        let Type::List(type_) = list.type_.clone() else {
            let text = self.sources.text(of.span).to_owned();
            return self.no_members(&text, at);
        };
        if let (Kind::Number(k), Kind::Let(value)) = (&number.kind, &list.kind)
            && let Kind::List(all) = &value.kind
            && (*k < 1.0 || *k > all.len() as f64)
        {
            let problem = Problem::error(&INDEX_OUT_OF_RANGE, format!("the list has no entry {k}"))
                .at(index.span, format!("there is no number {k}"))
                .with(value.span, format!("{} entries", all.len()));
            return self.poison(at, problem.help(format!("entries are numbered from 1 to {}", all.len())));
        }
        self.make(Kind::Element(Box::new(list), Box::new(number)), *type_, at)
    }

    /// `walk[t]`
    fn on_track(&mut self, scope: &mut Scope, of: &'a ExprAt, index: &'a ExprAt, at: Span) -> Expr {
        let time = Type::Number(self.units.base("time"));
        let time = self.wanted(scope, index, &time, &Wanted::by("the time on a recording"));
        let track = self.item_value(scope, of).unwrap_or_else(|| Expr::poison(at));
        if track.is_poison() || time.is_poison() {
            return Expr::poison(at);
        }
        let point = Type::Vector(self.units.base("length"));
        self.make(Kind::OnTrack(Box::new(track), Box::new(time)), point, at)
    }

    /// The formation or the recording of a name; `None` if it names neither.
    pub fn item_value(&mut self, scope: &mut Scope, at: &ExprAt) -> Option<Expr> {
        let ast::Expr::Name(name) = &at.node else { return None };
        if let Some((kind, type_)) = scope.local(name) {
            return matches!(type_, Type::Formation | Type::Track).then(|| self.make(kind, type_, at.span));
        }
        let entry = self.find(scope.module, Space::Value, name)?;
        if let Some(&id) = self.ids.formations.get(&entry.id) {
            return Some(self.make(Kind::Formation(id), Type::Formation, at.span));
        }
        let &id = self.ids.tracks.get(&entry.id)?;
        Some(self.make(Kind::Track(id), Type::Track, at.span))
    }

    /// The set that a name or call stands for, as a value; `None` if it is none.
    pub fn group_value(&mut self, scope: &mut Scope, at: &'a ExprAt) -> Option<Expr> {
        let is_set = match &at.node {
            ast::Expr::Name(name) => {
                matches!(name.as_str(), "all" | "obstacles")
                    || matches!(scope.local(name), Some((Kind::Group(_), _)))
                    || self.group_named(scope, at).is_some()
            }
            ast::Expr::Call(call) => matches!(call.name.node.as_str(), "pairs" | "members"),
            _ => false,
        };
        if !is_set {
            return None;
        }
        Some(match self.set(scope, at) {
            Some(set) => self.make(Kind::Group(set), Type::Group, at.span),
            None => Expr::poison(at.span),
        })
    }

    /// `F[i]` or `T[i, j]`
    fn place_or_distance(
        &mut self,
        scope: &mut Scope,
        of: &'a ExprAt,
        name: &str,
        index: &'a ExprAt,
        at: Span,
    ) -> Expr {
        let Some(formation) = self.item_value(scope, of) else { return Expr::poison(at) };
        match &index.node {
            ast::Expr::Vector(a, b) => {
                let (a, b) = (self.agent_of(scope, name, a, a.span), self.agent_of(scope, name, b, b.span));
                if formation.is_poison() || a.is_poison() || b.is_poison() {
                    return Expr::poison(at);
                }
                let length = Type::Number(self.units.base("length"));
                self.make(Kind::Rest(Box::new(formation), Box::new([a, b])), length, at)
            }
            _ => self.slot(scope, formation, name, index, at),
        }
    }

    pub fn agent_of(&mut self, scope: &mut Scope, what: &str, index: &'a ExprAt, at: Span) -> Expr {
        if let Some(group) = self.group_named(scope, index)
            && self.hir.world.groups.get(group).is_some_and(|group| group.size > 1)
        {
            return self.many(what, group, index.span, at);
        }
        let agent = self.expr(scope, index);
        let why = Wanted::by(format!("what stands in `{what}[…]`"));
        let number = matches!(agent.type_, Type::Number(_));
        if number {
            let problem = Problem::error(&BAD_INDEX, format!("`{what}[…]` wants an agent, not a number"))
                .at(agent.span, "this is a number")
                .help(match self.hir.world.groups.iter().find(|group| group.size > 1) {
                    Some(group) => {
                        format!(
                            "a member is written `{what}[{}[{}]]`",
                            group.name,
                            self.sources.text(index.span)
                        )
                    }
                    None => format!("write an agent's name or an index: `{what}[i]`"),
                });
            return self.poison(at, problem);
        }
        let agent = self.fits(agent, &Type::Agent(None), &why, &[], &mut Default::default());
        if agent.is_poison() { Expr::poison(at) } else { agent }
    }

    /// A group of several where one agent is wanted.
    fn many(&mut self, what: &str, group: GroupId, index: Span, at: Span) -> Expr {
        let Some((name, size)) =
            self.hir.world.groups.get(group).map(|group| (group.name.clone(), group.size))
        else {
            return Expr::poison(at);
        };
        let problem = Problem::error(
            &GROUP_AS_AGENT,
            format!("`{name}` is {size} agents; `{what}[…]` wants one"),
        )
        .at(index, format!("a group of {size}"))
        .help(format!(
            "write `{what}[i]` and say for which: `{what}[i] for i in {name}`, or `sum(i in {name}) …`"
        ));
        self.poison(at, problem)
    }

    pub fn group_named(&self, scope: &Scope, at: &ExprAt) -> Option<GroupId> {
        let ast::Expr::Name(name) = &at.node else { return None };
        if scope.local(name).is_some() {
            return None;
        }
        self.ids.groups.get(&self.program.find(scope.module, Space::Value, name)?.id).copied()
    }

    /// `F[i]`, also `F[2]`
    fn slot(&mut self, scope: &mut Scope, formation: Expr, name: &str, index: &'a ExprAt, at: Span) -> Expr {
        // Of an argument it is not known yet which formation it is.
        let Kind::Formation(id) = formation.kind else {
            let agent = self.agent_of(scope, name, index, at);
            return self.slot_of(formation, agent, at);
        };
        let Some(group) = self.hir.world.formations.get(id).map(|formation| formation.group) else {
            return self.unknown_yet(at);
        };
        if group == usize::MAX {
            return Expr::poison(at);
        }
        if let ast::Expr::Number { .. } = index.node {
            let agent = self.member_of(scope, group, index, index.span);
            return self.slot_of(formation, agent, at);
        }
        let agent = self.agent_of(scope, name, index, at);
        // Of an argument it is not known yet whose member it is.
        let known = !matches!(agent.kind, Kind::Argument(_) | Kind::Own);
        if let Type::Agent(other) = agent.type_
            && other != Some(group)
            && known
        {
            let name_of = |group: GroupId| self.hir.world.groups.get(group).map_or("", |group| &group.name);
            let own = name_of(group);
            let (message, label) = match other.map(name_of) {
                Some(other) => (
                    format!("`{name}` has places for `{own}`, not for `{other}`"),
                    format!("an agent of `{other}`"),
                ),
                None => (format!("`{name}` has places for `{own}` only"), "may be any agent".to_owned()),
            };
            let problem = Problem::error(&FOREIGN_SLOT, message)
                .at(index.span, label)
                .with(self.formation_span(id), format!("a formation of `{own}`"))
                .help(format!("run over its members: `i in {own}`"));
            return self.poison(at, problem);
        }
        self.slot_of(formation, agent, at)
    }

    fn formation_span(&self, formation: FormationId) -> Span {
        self.hir.world.formations.get(formation).map(|formation| formation.span).unwrap_or_default()
    }

    fn slot_of(&mut self, formation: Expr, agent: Expr, at: Span) -> Expr {
        if agent.is_poison() || formation.is_poison() {
            return Expr::poison(at);
        }
        let type_ = Type::Vector(self.units.base("length"));
        self.make(Kind::Slot(Box::new(formation), Box::new(agent)), type_, at)
    }

    /// `follower[2]`: members are numbered from 1.
    fn member_of(&mut self, scope: &mut Scope, group: GroupId, index: &'a ExprAt, at: Span) -> Expr {
        let why = Wanted::by("the number of a member");
        let number = self.wanted(scope, index, &Type::Count, &why);
        let Some((name, size, span)) =
            self.hir.world.groups.get(group).map(|group| (group.name.clone(), group.size, group.span))
        else {
            return Expr::poison(at);
        };
        if size == 0 {
            return self.unknown_yet(at);
        }
        let Some(number) = self.constant(&number, &"the number of a member") else { return Expr::poison(at) };
        if number.fract() != 0.0 || number < 1.0 || number > size as f64 {
            let agents = if size == 1 { "agent" } else { "agents" };
            let problem = Problem::error(&INDEX_OUT_OF_RANGE, format!("`{name}` has no member {number}"))
                .at(index.span, format!("there is no number {number}"))
                .with(span, format!("{size} {agents}"))
                .help(match size {
                    1 => "its only member is number 1".to_owned(),
                    _ => format!("members are numbered from 1 to {size}"),
                });
            return self.poison(at, problem);
        }
        self.make(Kind::Fixed(group, number as usize - 1), Type::Agent(Some(group)), at)
    }
}

pub const GROUP_AS_AGENT: Code = Code {
    name: "group-as-agent",
    explain: "\
A group of several agents stands where one agent is wanted. A group of one is its agent; of others, say which.

    observe { p[follower] }                     // wrong with three followers
    observe { p[i] for i in follower }          // right: all of them
    observe { p[follower[1]] }                  // right: the first",
};

pub const BAD_INDEX: Code = Code {
    name: "bad-index",
    explain: "\
Square brackets follow p, v, heading, a formation or a group, and hold an agent; of a group, the number of a member.

    p[2]                        // wrong: a number is no agent
    p[follower[2]]              // right",
};

pub const INDEX_OUT_OF_RANGE: Code = Code {
    name: "index-out-of-range",
    explain: "\
Members of a group are numbered from 1 to its size.

    agents follower[3] : point { … }
    F[4]                        // wrong: three followers
    F[3]                        // right: where the last belongs",
};

pub const FOREIGN_SLOT: Code = Code {
    name: "foreign-slot",
    explain: "\
A formation has a place for each member of its group, and for nobody else.

    formation F of follower = square(0.4 m) about leader
    sum(i in all) |p[i] - F[i]|             // wrong: the leader has no place in F
    sum(i in follower) |p[i] - F[i]|        // right",
};
