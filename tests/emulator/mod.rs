//! The shaders on the host, operation by operation, on unfriendly floats.
//!
//! The WGSL is parsed by naga, and its functions are run as naga gives them: what is tested is the
//! text that devices get, not a twin of it. Only what the shaders use is known here; anything else
//! panics.

pub mod float;

use std::{collections::HashMap, rc::Rc, sync::Arc};

use float::{Float, Unfriendly};
use naga::{
    BinaryOperator, Block, BuiltIn, Expression, Function, GlobalVariable, Handle, Literal,
    LocalVariable, MathFunction, Module, ScalarKind, Statement, Type, TypeInner, UnaryOperator,
};

/// Up to four of a kind, without memory of their own.
#[derive(Clone, Debug, Default)]
pub struct Few<T> {
    values: [T; 4],
    count: usize,
}

fn one<T: Default>(value: T) -> Few<T> {
    std::iter::once(value).collect()
}

impl<T: Default> FromIterator<T> for Few<T> {
    fn from_iter<I: IntoIterator<Item = T>>(from: I) -> Self {
        let mut few = Self { values: Default::default(), count: 0 };
        few.extend(from);
        few
    }
}

impl<T> Extend<T> for Few<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, from: I) {
        for value in from {
            self.values[self.count] = value;
            self.count += 1;
        }
    }
}

impl<T> IntoIterator for Few<T> {
    type Item = T;
    type IntoIter = std::iter::Take<std::array::IntoIter<T, 4>>;

    fn into_iter(self) -> Self::IntoIter {
        self.values.into_iter().take(self.count)
    }
}

impl<T> std::ops::Deref for Few<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values[..self.count]
    }
}

impl<T> std::ops::DerefMut for Few<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.values[..self.count]
    }
}

/// A number, a vector or a struct.
#[derive(Clone, Debug)]
pub enum Value {
    /// Truths.
    Bool(Few<bool>),
    /// Integers, signed ones as their bits.
    U32(Few<u32>),
    /// Signed integers.
    I32(Few<i32>),
    /// Numbers.
    F32(Few<Float>),
    /// Fields.
    Struct(Rc<[Value]>),
}

impl Value {
    /// Numbers.
    pub fn floats(values: &[f32]) -> Self {
        Self::F32(values.iter().map(|&v| v.into()).collect())
    }

    /// Lane `k` of numbers.
    pub fn float(&self, k: usize) -> f32 {
        match self {
            Self::F32(v) => v[k].value,
            other => panic!("{other:?} has no numbers"),
        }
    }

    /// Lane `k` of unsigned integers.
    pub fn uint(&self, k: usize) -> u32 {
        match self {
            Self::U32(v) => v[k],
            other => panic!("{other:?} has no unsigned integers"),
        }
    }

    /// A signed integer.
    pub fn int(&self, k: usize) -> i32 {
        match self {
            Self::I32(v) => v[k],
            other => panic!("{other:?} is no signed integer"),
        }
    }

    /// Lane `k` of truths.
    pub fn holds(&self, k: usize) -> bool {
        match self {
            Self::Bool(v) => v[k],
            other => panic!("{other:?} has no truths"),
        }
    }

    /// Field or lane `k`.
    pub fn part(&self, k: usize) -> Self {
        match self {
            Self::Bool(v) => Self::Bool(one(v[k])),
            Self::U32(v) => Self::U32(one(v[k])),
            Self::I32(v) => Self::I32(one(v[k])),
            Self::F32(v) => Self::F32(one(v[k].clone())),
            Self::Struct(fields) => fields[k].clone(),
        }
    }

    fn set(&mut self, path: &[u32], value: Self) {
        let Some((&k, rest)) = path.split_first() else {
            *self = value;
            return;
        };
        let k = k as usize;
        match (self, value) {
            (Self::Struct(fields), value) => {
                let mut all = fields.to_vec();
                all[k].set(rest, value);
                *fields = all.into();
            }
            (Self::F32(v), Self::F32(x)) => v[k] = x[0].clone(),
            (Self::U32(v), Self::U32(x)) => v[k] = x[0],
            (Self::I32(v), Self::I32(x)) => v[k] = x[0],
            (Self::Bool(v), Self::Bool(x)) => v[k] = x[0],
            (old, new) => panic!("{new:?} into {old:?}"),
        }
    }

    fn lanes(&self) -> usize {
        match self {
            Self::Bool(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::I32(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::Struct(_) => panic!("a struct has no lanes"),
        }
    }
}

/// A shader and the device that runs it.
pub struct Machine {
    module: Arc<Module>,
    names: HashMap<String, Handle<Function>>,
    /// The device's floats.
    pub floats: Unfriendly,
    /// What is bound: one value, or the elements of a run-time array.
    bound: HashMap<u32, Vec<Value>>,
}

/// Where a pointer points.
enum Place {
    Global(Handle<GlobalVariable>, Vec<u32>),
    Local(Handle<LocalVariable>, Vec<u32>),
}

/// A function that runs.
struct Frame<'a> {
    function: &'a Function,
    /// Tells its operations from those of others.
    site: u64,
    arguments: Vec<Value>,
    locals: HashMap<Handle<LocalVariable>, Value>,
    known: Vec<Option<Value>>,
}

/// How a block ends.
enum Flow {
    Next,
    Break,
    Continue,
    Return(Option<Value>),
}

impl Machine {
    /// For a module that was validated.
    pub fn new(module: Arc<Module>, floats: Unfriendly) -> Self {
        let names =
            module.functions.iter().filter_map(|(h, f)| Some((f.name.clone()?, h))).collect();
        Self { module, names, floats, bound: HashMap::new() }
    }

    /// Binds bytes as the host would send them.
    pub fn bind(&mut self, binding: u32, bytes: &[u8]) {
        let module = self.module.clone();
        let ty = module
            .global_variables
            .iter()
            .find(|(_, v)| v.binding.as_ref().is_some_and(|b| b.binding == binding))
            .map(|(_, v)| v.ty);
        // A variant may not have it.
        let Some(ty) = ty else { return };
        let values = match &module.types[ty].inner {
            TypeInner::Array { base, stride, .. } => bytes
                .chunks_exact(*stride as usize)
                .map(|part| decode(&module, *base, part))
                .collect(),
            _ => vec![decode(&module, ty, bytes)],
        };
        self.bound.insert(binding, values);
    }

    /// The elements of a run-time array.
    pub fn read(&self, binding: u32) -> &[Value] {
        &self.bound[&binding]
    }

    /// Takes what is bound, to bind it again.
    pub fn take(&mut self, binding: u32) -> Vec<Value> {
        self.bound.remove(&binding).unwrap_or_default()
    }

    /// Binds what was taken.
    pub fn put(&mut self, binding: u32, values: Vec<Value>) {
        self.bound.insert(binding, values);
    }

    /// Runs a function that returns something.
    pub fn call(&mut self, name: &str, arguments: Vec<Value>) -> Value {
        self.perform(name, arguments).expect("it returns something")
    }

    /// Runs a function for what it does.
    pub fn perform(&mut self, name: &str, arguments: Vec<Value>) -> Option<Value> {
        let handle = self.names[name];
        self.run(handle, arguments)
    }

    /// A field of a struct that a function returned, by the name of its type and its own.
    pub fn field(&self, value: &Value, kind: &str, name: &str) -> Value {
        let members = self.module.types.iter().find_map(|(_, ty)| match &ty.inner {
            TypeInner::Struct { members, .. } if ty.name.as_deref() == Some(kind) => Some(members),
            _ => None,
        });
        let k = members
            .expect("a struct")
            .iter()
            .position(|m| m.name.as_deref() == Some(name))
            .expect("a field");
        value.part(k)
    }

    /// Runs one invocation of `main`.
    pub fn invoke(&mut self, group: [u32; 3], local: u32) {
        let module = self.module.clone();
        let function = &module.entry_points[0].function;
        let arguments = function
            .arguments
            .iter()
            .map(|argument| match argument.binding {
                Some(naga::Binding::BuiltIn(BuiltIn::WorkGroupId)) => {
                    Value::U32(group.into_iter().collect())
                }
                Some(naga::Binding::BuiltIn(BuiltIn::LocalInvocationIndex)) => {
                    Value::U32(one(local))
                }
                ref other => panic!("{other:?} is not known"),
            })
            .collect();
        self.body(function, 0, arguments);
    }

    fn run(&mut self, handle: Handle<Function>, arguments: Vec<Value>) -> Option<Value> {
        let module = self.module.clone();
        self.body(&module.functions[handle], 1 + handle.index() as u64, arguments)
    }

    fn body(&mut self, function: &Function, site: u64, arguments: Vec<Value>) -> Option<Value> {
        let mut frame = Frame {
            function,
            site: site << 32,
            arguments,
            locals: HashMap::new(),
            known: vec![None; function.expressions.len()],
        };
        for (handle, variable) in function.local_variables.iter() {
            let value = match variable.init {
                Some(init) => self.value(&mut frame, init),
                None => zero(&self.module, variable.ty),
            };
            frame.locals.insert(handle, value);
        }
        match self.block(&mut frame, &function.body) {
            Flow::Return(value) => value,
            _ => None,
        }
    }

    fn block(&mut self, frame: &mut Frame, block: &Block) -> Flow {
        for statement in block.iter() {
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        if !is_pointer(frame.function, handle) {
                            let value = self.evaluate(frame, handle);
                            frame.known[handle.index()] = Some(value);
                        }
                    }
                }
                Statement::Block(block) => match self.block(frame, block) {
                    Flow::Next => {}
                    other => return other,
                },
                Statement::If { condition, accept, reject } => {
                    let branch =
                        if self.value(frame, *condition).holds(0) { accept } else { reject };
                    match self.block(frame, branch) {
                        Flow::Next => {}
                        other => return other,
                    }
                }
                Statement::Loop { body, continuing, break_if } => loop {
                    match self.block(frame, body) {
                        Flow::Break => break,
                        Flow::Return(value) => return Flow::Return(value),
                        Flow::Next | Flow::Continue => {}
                    }
                    match self.block(frame, continuing) {
                        Flow::Next => {}
                        _ => panic!("a jump out of a continuing block"),
                    }
                    if let Some(condition) = break_if
                        && self.value(frame, *condition).holds(0)
                    {
                        break;
                    }
                },
                Statement::Break => return Flow::Break,
                Statement::Continue => return Flow::Continue,
                Statement::Return { value } => {
                    return Flow::Return(value.map(|value| self.value(frame, value)));
                }
                Statement::Store { pointer, value } => {
                    let value = self.value(frame, *value);
                    match self.place(frame, *pointer) {
                        Place::Local(local, path) => {
                            frame.locals.get_mut(&local).expect("a local").set(&path, value);
                        }
                        Place::Global(global, path) => {
                            let (binding, at, path) = self.element(global, &path);
                            self.bound.get_mut(&binding).expect("it is bound")[at]
                                .set(&path, value);
                        }
                    }
                }
                Statement::Call { function, arguments, result } => {
                    let arguments = arguments.iter().map(|&a| self.value(frame, a)).collect();
                    let value = self.run(*function, arguments);
                    if let Some(result) = result {
                        frame.known[result.index()] = value;
                    }
                }
                other => panic!("{other:?} is not known"),
            }
        }
        Flow::Next
    }

    /// Binding, element and path inside it.
    fn element(&self, global: Handle<GlobalVariable>, path: &[u32]) -> (u32, usize, Vec<u32>) {
        let variable = &self.module.global_variables[global];
        let binding = variable.binding.as_ref().expect("a bound variable").binding;
        match self.module.types[variable.ty].inner {
            TypeInner::Array { .. } => (binding, path[0] as usize, path[1..].to_vec()),
            _ => (binding, 0, path.to_vec()),
        }
    }

    fn place(&mut self, frame: &mut Frame, pointer: Handle<Expression>) -> Place {
        let further = |place: Place, k: u32| match place {
            Place::Global(handle, mut path) => {
                path.push(k);
                Place::Global(handle, path)
            }
            Place::Local(handle, mut path) => {
                path.push(k);
                Place::Local(handle, path)
            }
        };
        match frame.function.expressions[pointer] {
            Expression::GlobalVariable(handle) => Place::Global(handle, Vec::new()),
            Expression::LocalVariable(handle) => Place::Local(handle, Vec::new()),
            Expression::AccessIndex { base, index } => further(self.place(frame, base), index),
            Expression::Access { base, index } => {
                let index = match self.value(frame, index) {
                    Value::U32(v) => v[0],
                    Value::I32(v) => v[0] as u32,
                    other => panic!("{other:?} is no index"),
                };
                further(self.place(frame, base), index)
            }
            ref other => panic!("{other:?} is no pointer"),
        }
    }

    fn value(&mut self, frame: &mut Frame, handle: Handle<Expression>) -> Value {
        match &frame.known[handle.index()] {
            Some(value) => value.clone(),
            None => self.evaluate(frame, handle),
        }
    }

    fn evaluate(&mut self, frame: &mut Frame, handle: Handle<Expression>) -> Value {
        let site = frame.site + ((handle.index() as u64) << 8);
        match &frame.function.expressions[handle] {
            Expression::Literal(literal) => from_literal(*literal),
            Expression::Constant(constant) => {
                let module = self.module.clone();
                global(&module, module.constants[*constant].init)
            }
            Expression::ZeroValue(ty) => zero(&self.module, *ty),
            Expression::FunctionArgument(k) => frame.arguments[*k as usize].clone(),
            Expression::Compose { ty, components } => {
                let parts: Vec<Value> = components.iter().map(|&c| self.value(frame, c)).collect();
                match self.module.types[*ty].inner {
                    TypeInner::Struct { .. } => Value::Struct(parts.into()),
                    _ => joined(parts),
                }
            }
            Expression::Splat { size, value } => {
                let value = self.value(frame, *value);
                joined(vec![value; *size as usize])
            }
            Expression::Swizzle { size, vector, pattern } => {
                let vector = self.value(frame, *vector);
                joined(pattern[..*size as usize].iter().map(|&k| vector.part(k as usize)))
            }
            Expression::AccessIndex { base, index } => {
                let (base, index) = (*base, *index);
                self.value(frame, base).part(index as usize)
            }
            Expression::Load { pointer } => match self.place(frame, *pointer) {
                Place::Local(local, path) => {
                    path.iter().fold(frame.locals[&local].clone(), |v, &k| v.part(k as usize))
                }
                Place::Global(global, path) => {
                    let (binding, at, path) = self.element(global, &path);
                    path.iter().fold(self.bound[&binding][at].clone(), |v, &k| v.part(k as usize))
                }
            },
            Expression::Unary { op, expr } => {
                let value = self.value(frame, *expr);
                match (op, value) {
                    (UnaryOperator::Negate, Value::F32(v)) => {
                        Value::F32(v.iter().map(Float::negated).collect())
                    }
                    (UnaryOperator::Negate, Value::I32(v)) => {
                        Value::I32(v.iter().map(|x| x.wrapping_neg()).collect())
                    }
                    (UnaryOperator::LogicalNot, Value::Bool(v)) => {
                        Value::Bool(v.iter().map(|x| !x).collect())
                    }
                    (UnaryOperator::BitwiseNot, Value::U32(v)) => {
                        Value::U32(v.iter().map(|x| !x).collect())
                    }
                    (op, value) => panic!("{op:?} of {value:?}"),
                }
            }
            Expression::Binary { op, left, right } => {
                let (op, left, right) = (*op, *left, *right);
                let (left, right) = (self.value(frame, left), self.value(frame, right));
                self.binary(site, op, left, right)
            }
            Expression::Select { condition, accept, reject } => {
                let (condition, accept, reject) = (*condition, *accept, *reject);
                let (accept, reject) = (self.value(frame, accept), self.value(frame, reject));
                let Value::Bool(condition) = self.value(frame, condition) else {
                    panic!("no condition")
                };
                if condition.len() == 1 {
                    return if condition[0] { accept } else { reject };
                }
                let pick = |k: usize| if condition[k] { accept.part(k) } else { reject.part(k) };
                joined((0..condition.len()).map(pick))
            }
            Expression::As { expr, kind, convert } => {
                let value = self.value(frame, *expr);
                self.cast(site, value, *kind, convert.is_some())
            }
            Expression::Math { fun, arg, arg1, .. } => {
                let (fun, arg, arg1) = (*fun, *arg, *arg1);
                let arg = self.value(frame, arg);
                let other = arg1.map(|other| self.value(frame, other));
                self.math(site, fun, arg, other)
            }
            other => panic!("{other:?} is not known"),
        }
    }

    fn binary(&mut self, site: u64, op: BinaryOperator, left: Value, right: Value) -> Value {
        use BinaryOperator as B;
        let lanes = left.lanes().max(right.lanes());
        let (l, r) = (|k: usize| k.min(left.lanes() - 1), |k: usize| k.min(right.lanes() - 1));
        match (&left, &right) {
            (Value::F32(a), Value::F32(b)) => {
                let floats = &mut self.floats;
                let compared = |floats: &mut Unfriendly, test: fn(f32, f32) -> bool| {
                    Value::Bool(
                        (0..lanes)
                            .map(|k| test(floats.seen(&a[l(k)]), floats.seen(&b[r(k)])))
                            .collect(),
                    )
                };
                let mut each =
                    |f: &mut dyn FnMut(&mut Unfriendly, u64, &Float, &Float) -> Float| {
                        Value::F32(
                            (0..lanes)
                                .map(|k| f(floats, site + 16 * k as u64, &a[l(k)], &b[r(k)]))
                                .collect(),
                        )
                    };
                match op {
                    B::Add => each(&mut |f, site, a, b| f.add(site, a, b)),
                    B::Subtract => each(&mut |f, site, a, b| f.add(site, a, &b.negated())),
                    B::Multiply => each(&mut |f, site, a, b| f.mul(site, a, b)),
                    B::Divide => each(&mut |f, site, a, b| f.div(site, a, b)),
                    B::Less => compared(floats, |a, b| a < b),
                    B::LessEqual => compared(floats, |a, b| a <= b),
                    B::Greater => compared(floats, |a, b| a > b),
                    B::GreaterEqual => compared(floats, |a, b| a >= b),
                    B::Equal => compared(floats, |a, b| a == b),
                    B::NotEqual => compared(floats, |a, b| a != b),
                    other => panic!("{other:?} of floats"),
                }
            }
            (Value::U32(a), Value::U32(b)) => integers(
                op,
                lanes,
                |k| i64::from(a[l(k)]),
                |k| i64::from(b[r(k)]),
                |v| Value::U32(v.iter().map(|&x| x as u32).collect()),
            ),
            (Value::I32(a), Value::I32(b)) => integers(
                op,
                lanes,
                |k| i64::from(a[l(k)]),
                |k| i64::from(b[r(k)]),
                |v| Value::I32(v.iter().map(|&x| x as i32).collect()),
            ),
            (Value::I32(a), Value::U32(b)) => integers(
                op,
                lanes,
                |k| i64::from(a[l(k)]),
                |k| i64::from(b[r(k)]),
                |v| Value::I32(v.iter().map(|&x| x as i32).collect()),
            ),
            (Value::Bool(a), Value::Bool(b)) => {
                let both = |f: fn(bool, bool) -> bool| {
                    Value::Bool((0..lanes).map(|k| f(a[l(k)], b[r(k)])).collect())
                };
                match op {
                    B::And | B::LogicalAnd => both(|a, b| a & b),
                    B::InclusiveOr | B::LogicalOr => both(|a, b| a | b),
                    B::Equal => both(|a, b| a == b),
                    other => panic!("{other:?} of truths"),
                }
            }
            (a, b) => panic!("{op:?} of {a:?} and {b:?}"),
        }
    }

    fn cast(&mut self, site: u64, value: Value, kind: ScalarKind, convert: bool) -> Value {
        let floats = &mut self.floats;
        match (value, kind, convert) {
            (Value::F32(v), ScalarKind::Uint, false) => {
                Value::U32(v.iter().map(|x| floats.seen(x).to_bits()).collect())
            }
            (Value::F32(v), ScalarKind::Sint, false) => {
                Value::I32(v.iter().map(|x| floats.seen(x).to_bits() as i32).collect())
            }
            (Value::U32(v), ScalarKind::Float, false) => Value::F32(
                v.iter().map(|&x| floats.seen(&f32::from_bits(x).into()).into()).collect(),
            ),
            (Value::I32(v), ScalarKind::Float, false) => Value::F32(
                v.iter().map(|&x| floats.seen(&f32::from_bits(x as u32).into()).into()).collect(),
            ),
            (Value::U32(v), ScalarKind::Sint, _) => {
                Value::I32(v.iter().map(|&x| x as i32).collect())
            }
            (Value::I32(v), ScalarKind::Uint, _) => {
                Value::U32(v.iter().map(|&x| x as u32).collect())
            }
            (Value::U32(v), ScalarKind::Float, true) => {
                Value::F32(v.iter().map(|&x| floats.convert(site, f64::from(x))).collect())
            }
            (Value::I32(v), ScalarKind::Float, true) => {
                Value::F32(v.iter().map(|&x| floats.convert(site, f64::from(x))).collect())
            }
            (value @ Value::Bool(_), ScalarKind::Bool, _) => value,
            (value, kind, _) => panic!("{value:?} as {kind:?}"),
        }
    }

    fn math(&mut self, site: u64, fun: MathFunction, arg: Value, other: Option<Value>) -> Value {
        use MathFunction as M;
        match (fun, arg, other) {
            (M::Abs, Value::F32(v), None) => Value::F32(
                v.iter().map(|x| if x.value < 0.0 { x.negated() } else { x.clone() }).collect(),
            ),
            (M::Sqrt, Value::F32(v), None) => Value::F32(
                v.iter()
                    .enumerate()
                    .map(|(k, x)| self.floats.sqrt(site + 16 * k as u64, x))
                    .collect(),
            ),
            (M::Min, Value::F32(a), Some(Value::F32(b))) => Value::F32(
                a.iter()
                    .zip(b.iter())
                    .map(|(a, b)| if b.value < a.value { b.clone() } else { a.clone() })
                    .collect(),
            ),
            (M::Max, Value::F32(a), Some(Value::F32(b))) => Value::F32(
                a.iter()
                    .zip(b.iter())
                    .map(|(a, b)| if a.value < b.value { b.clone() } else { a.clone() })
                    .collect(),
            ),
            (M::Min, Value::U32(a), Some(Value::U32(b))) => {
                Value::U32(a.iter().zip(b.iter()).map(|(&a, &b)| a.min(b)).collect())
            }
            (M::Max, Value::U32(a), Some(Value::U32(b))) => {
                Value::U32(a.iter().zip(b.iter()).map(|(&a, &b)| a.max(b)).collect())
            }
            (M::Min, Value::I32(a), Some(Value::I32(b))) => {
                Value::I32(a.iter().zip(b.iter()).map(|(&a, &b)| a.min(b)).collect())
            }
            (M::Max, Value::I32(a), Some(Value::I32(b))) => {
                Value::I32(a.iter().zip(b.iter()).map(|(&a, &b)| a.max(b)).collect())
            }
            (M::Dot, Value::I32(a), Some(Value::I32(b))) => {
                let sum: i64 =
                    a.iter().zip(b.iter()).map(|(&a, &b)| i64::from(a) * i64::from(b)).sum();
                Value::I32(one(
                    i32::try_from(sum).expect("the dot product of the shader fits 32 bits")
                ))
            }
            (M::FirstTrailingBit, Value::U32(v), None) => Value::U32(
                v.iter().map(|x| if *x == 0 { u32::MAX } else { x.trailing_zeros() }).collect(),
            ),
            (fun, a, b) => panic!("{fun:?} of {a:?} and {b:?}"),
        }
    }
}

/// Integers wrap where the shader wants it to; signed ones must not, since their sums are meant to
/// be exact.
fn integers(
    op: BinaryOperator,
    lanes: usize,
    a: impl Fn(usize) -> i64,
    b: impl Fn(usize) -> i64,
    made: impl Fn(Few<i64>) -> Value,
) -> Value {
    use BinaryOperator as B;
    let compared =
        |test: fn(i64, i64) -> bool| Value::Bool((0..lanes).map(|k| test(a(k), b(k))).collect());
    let each = |f: fn(i64, i64) -> i64| {
        let values: Few<i64> = (0..lanes).map(|k| f(a(k), b(k))).collect();
        let fits = |v: &i64| (-(1i64 << 31)..1 << 32).contains(v);
        assert!(
            values.iter().all(fits),
            "an integer of the shader overflows: {op:?} gives {values:?}"
        );
        made(values)
    };
    match op {
        B::Add => each(|a, b| a + b),
        B::Subtract => each(|a, b| a - b),
        B::Multiply => each(|a, b| a * b),
        B::Divide => each(|a, b| a / b),
        B::Modulo => each(|a, b| a % b),
        B::And => each(|a, b| a & b),
        B::InclusiveOr => each(|a, b| a | b),
        B::ExclusiveOr => each(|a, b| a ^ b),
        B::ShiftLeft => each(|a, b| a << b),
        B::ShiftRight => each(|a, b| a >> b),
        B::Equal => compared(|a, b| a == b),
        B::NotEqual => compared(|a, b| a != b),
        B::Less => compared(|a, b| a < b),
        B::LessEqual => compared(|a, b| a <= b),
        B::Greater => compared(|a, b| a > b),
        B::GreaterEqual => compared(|a, b| a >= b),
        B::LogicalAnd | B::LogicalOr => panic!("{op:?} of integers"),
    }
}

/// Whether an expression is a way to memory rather than a value.
fn is_pointer(function: &Function, handle: Handle<Expression>) -> bool {
    match function.expressions[handle] {
        Expression::GlobalVariable(_) | Expression::LocalVariable(_) => true,
        Expression::AccessIndex { base, .. } | Expression::Access { base, .. } => {
            is_pointer(function, base)
        }
        _ => false,
    }
}

fn from_literal(literal: Literal) -> Value {
    match literal {
        Literal::F32(v) => Value::floats(&[v]),
        Literal::U32(v) => Value::U32(one(v)),
        Literal::I32(v) => Value::I32(one(v)),
        Literal::Bool(v) => Value::Bool(one(v)),
        other => panic!("{other:?} is not known"),
    }
}

fn global(module: &Module, handle: Handle<Expression>) -> Value {
    match &module.global_expressions[handle] {
        Expression::Literal(literal) => from_literal(*literal),
        Expression::Constant(constant) => global(module, module.constants[*constant].init),
        Expression::ZeroValue(ty) => zero(module, *ty),
        Expression::Splat { size, value } => joined(vec![global(module, *value); *size as usize]),
        Expression::Compose { ty, components } => {
            let parts: Vec<Value> = components.iter().map(|&c| global(module, c)).collect();
            match module.types[*ty].inner {
                TypeInner::Struct { .. } => Value::Struct(parts.into()),
                _ => joined(parts),
            }
        }
        other => panic!("{other:?} is not known"),
    }
}

/// A vector of scalars and vectors.
fn joined(parts: impl IntoIterator<Item = Value>) -> Value {
    let mut parts = parts.into_iter();
    let mut all = parts.next().expect("a vector has lanes");
    for part in parts {
        match (&mut all, part) {
            (Value::Bool(a), Value::Bool(b)) => a.extend(b),
            (Value::U32(a), Value::U32(b)) => a.extend(b),
            (Value::I32(a), Value::I32(b)) => a.extend(b),
            (Value::F32(a), Value::F32(b)) => a.extend(b),
            (a, b) => panic!("{b:?} joined to {a:?}"),
        }
    }
    all
}

fn zero(module: &Module, ty: Handle<Type>) -> Value {
    decode(module, ty, &[0; 256])
}

/// A value from the bytes that a host would send.
fn decode(module: &Module, ty: Handle<Type>, bytes: &[u8]) -> Value {
    let words = |count: usize| {
        (0..count).map(|k| u32::from_le_bytes(bytes[4 * k..4 * k + 4].try_into().expect("4 bytes")))
    };
    let scalars = |kind: ScalarKind, count: usize| match kind {
        ScalarKind::Bool => Value::Bool(words(count).map(|w| w != 0).collect()),
        ScalarKind::Uint => Value::U32(words(count).collect()),
        ScalarKind::Sint => Value::I32(words(count).map(|w| w as i32).collect()),
        ScalarKind::Float => Value::F32(words(count).map(|w| f32::from_bits(w).into()).collect()),
        other => panic!("{other:?} is not known"),
    };
    match &module.types[ty].inner {
        TypeInner::Scalar(scalar) => scalars(scalar.kind, 1),
        TypeInner::Vector { size, scalar } => scalars(scalar.kind, *size as usize),
        TypeInner::Struct { members, .. } => Value::Struct(
            members.iter().map(|m| decode(module, m.ty, &bytes[m.offset as usize..])).collect(),
        ),
        other => panic!("{other:?} is not known"),
    }
}
