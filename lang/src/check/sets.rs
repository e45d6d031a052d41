//! Agents, sets of them, and what is asked of each.

use super::fits::Wanted;
use super::{Checker, Scope};
use crate::ast::{self, Call, ExprAt, Item, Span, Spanned};
use crate::dim::Dim;
use crate::hir::{Expr, Kind, Over, Set, Type};
use crate::plan::{FormationId, GroupId, Quantity, Reduction};
use crate::print::reduction;
use crate::problem::{Code, Problem};
use crate::resolve::{ItemId, Space, listed};

impl<'a> Checker<'a> {
    /// A group of one stands for its agent.
    pub fn group_as_agent(&mut self, id: ItemId, name: &str, at: Span) -> Expr {
        let Some(&group) = self.ids.groups.get(&id) else { return Expr::poison(at) };
        match self.hir.world.groups.get(group).map(|group| group.size) {
            Some(1) => self.make(Kind::Fixed(group, 0), Type::Agent(Some(group)), at),
            None | Some(0) => Expr::poison(at),
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

    fn agent_of(&mut self, scope: &mut Scope, what: &str, index: &'a ExprAt, at: Span) -> Expr {
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

    fn group_named(&self, scope: &Scope, at: &ExprAt) -> Option<GroupId> {
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
            return Expr::poison(at);
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
            return Expr::poison(at);
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

    fn set(&mut self, scope: &mut Scope, at: &'a ExprAt) -> Option<Set> {
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
