"""A compiled fragment program: a tree of blocks, branches and loops of simple instructions.

The text is Mesa's NIR (in static single assignment form), printed by its reference rasteriser; see
``compiler.py``. The text's form changes between Mesa releases: `parse` reads the form of Mesa 22.3
and raises NotCountable for any other form. A **region** is code that runs under one condition: the
whole program, the body of a loop, or a side of a branch.
"""
from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from ..errors import ShaderError

_LINE = re.compile(r"(?:vec(?P<width>\d+)\s+(?P<bits>\d+)\s+ssa_(?P<to>\d+) = )?(?P<rest>.*)")
_SOURCE = re.compile(r"ssa_(\d+)(?:\.([xyzw]+))?")
_UNIFORM = re.compile(r"decl_var uniform \S+ (\S+) (\S+) \(\d+, (\d+), \d+\)")
_SAMPLER = re.compile(r"decl_var uniform \S+ [iu]?sampler2D (\S+) \(\d+, (\d+), \d+\)")
_OUTPUT = re.compile(r"decl_var shader_out \S+ \S+ (\S+) \(([^,]*), (\d+), \d+\)")
_LOCAL = re.compile(r"^\s+decl_var\s+\S+ (\w+)\[(\d+)\] (\S+)", re.M)

# Instructions that cost nothing on the shader hardware of 2002-2007: moves, swizzles, negated and
# absolute operands, constants, and conversions to integers, which the hardware held as floats.
FREE = {"mov", "vec2", "vec3", "vec4", "fneg", "ineg", "fabs", "iabs", "inot", "b2i32", "b2f32",
        "f2i32", "f2u32", "i2f32", "u2f32"}
_NO_ARITHMETIC = {"load_const", "phi", "deref_var", "deref_array", "load_ubo", "load_deref",
                  "store_deref", "discard_if", "txf", "break", "undefined"}
_ONE_A_COMPONENT = {"frcp", "frsq", "fsqrt"}   # a scalar unit computes each component
_DOTS = {"fdot2": 2, "fdot3": 3, "fdot4": 4}   # one vector instruction, or one per component
_STATEMENTS = {"intrinsic", "break", "continue", "return"}    # instructions without a value


class NotCountable(ShaderError):
    """The instructions of a program cannot be counted.

    This machine's Mesa does not print them, or prints them in a form that `parse` does not know.
    """


@dataclass
class Instruction:
    """An instruction. ``to`` is the number of the value that it computes, or -1; a source is a
    pair (number of a value, swizzle)."""

    op: str
    to: int = -1
    width: int = 0
    bits: int = 32
    sources: list[tuple[int, str]] = field(default_factory=list)
    bits_of_constant: tuple[int, ...] = ()
    predecessors: tuple[int, ...] = ()   # for a phi: the block that each source comes from
    name: str = ""                       # the variable, or the sampler of a fetch
    offset: int = 0                      # bytes of a uniform, or the constant index of an array
    mask: str = ""                       # the stored components


@dataclass
class Block:
    number: int
    instructions: list[Instruction] = field(default_factory=list)


@dataclass
class Branch:
    condition: int
    sides: tuple[list[Node], list[Node]]
    regions: tuple[int, int] = (0, 0)


@dataclass
class Loop:
    body: list[Node]
    region: int = 0


Node = Block | Branch | Loop


@dataclass
class RegionWork:
    """The cost of running a region once, without the regions inside it.

    Attributes
    ----------
    vector : instructions of a machine with vectors of four components
    scalar : instructions of a scalar machine
    fetches : texel fetches by sampler
    """

    vector: int = 0
    scalar: int = 0
    fetches: Counter[str] = field(default_factory=Counter)

    def __add__(self, other: RegionWork) -> RegionWork:
        return RegionWork(self.vector + other.vector, self.scalar + other.scalar,
                          self.fetches + other.fetches)


@dataclass
class Program:
    """A program's tree and the cost of each region.

    Attributes
    ----------
    tree : the nodes of the whole program
    samplers : names of the samplers
    uniforms : byte offset -> name and GLSL type
    outputs : name of an output -> location of its render target; -1 for depth
    arrays : name of a local array -> type and length
    work : the cost of each region; region 0 is the whole program
    parents : the enclosing region of each region; -1 for the whole program
    loops : regions that are bodies of loops, in the order of the text
    """

    tree: list[Node]
    samplers: list[str]
    uniforms: dict[int, tuple[str, str]]
    outputs: dict[str, int]
    arrays: dict[str, tuple[str, int]]
    work: list[RegionWork]
    parents: list[int]
    loops: list[int]

    @property
    def dependent_reads(self) -> int:
        """The longest chain of fetches in which the coordinates of each fetch depend on the fetch
        before it. Loop iterations are not followed."""
        levels: dict[int, int] = {}
        for one in self.instructions():
            # A later iteration of a loop depends on earlier ones. This is not counted, because
            # cards with loops have another limit for loops.
            sources = [levels.get(value, 0) for value, _ in one.sources]
            levels[one.to] = max(sources, default=0) + (one.op == "txf")
        return max(levels.values(), default=0)

    def instructions(self) -> Iterator[Instruction]:
        """Yield all instructions in the order of the text."""
        waiting = list(self.tree)
        while waiting:
            node = waiting.pop(0)
            if isinstance(node, Block):
                yield from node.instructions
            elif isinstance(node, Loop):
                waiting[:0] = node.body
            else:
                waiting[:0] = [*node.sides[0], *node.sides[1]]

    def flattened(self, region: int) -> RegionWork:
        """Return the work of a region with both sides of its branches, without inner loops."""
        total = self.work[region]
        for child, parent in enumerate(self.parents):
            if parent == region and child not in self.loops:
                total = total + self.flattened(child)
        return total


def parse(text: str) -> Program:
    """Parse the compiler's text of a program.

    Raises
    ------
    NotCountable
        if the text is not in the form of Mesa 22.3
    """
    try:
        return _parsed(text)
    except (IndexError, KeyError, ValueError) as failure:
        raise NotCountable(_unknown(str(failure))) from failure


def _unknown(what: str) -> str:
    return ("no instruction counts: they need Mesa 22.3 (Debian 12), whose softpipe prints "
            "programs in the only form that can be read; this machine's Mesa prints "
            f"{what.strip()[:40]!r}")


def _parsed(text: str) -> Program:
    if "impl main" not in text:
        raise NotCountable(_unknown("no main program"))
    uniforms = {16 * int(at): (name, kind) for kind, name, at in _UNIFORM.findall(text)
                if "sampler" not in kind}
    samplers = {int(at): name for name, at in _SAMPLER.findall(text)}
    outputs = {name: -1 if "DEPTH" in place else int(location)
               for name, place, location in _OUTPUT.findall(text)}
    arrays = {name: (kind, int(length)) for kind, length, name in _LOCAL.findall(text)}
    lines = iter(text[text.index("impl main"):].splitlines()[1:])
    tree = _nodes(lines, samplers)
    program = Program(tree, list(samplers.values()), uniforms, outputs, arrays, [], [], [])
    _number(program, tree, -1)
    return program


def _nodes(lines: Iterator[str], samplers: dict[int, str]) -> list[Node]:
    """Return the nodes up to the closing brace."""
    nodes: list[Node] = []
    for line in map(str.strip, lines):
        if line.startswith("}"):
            if nodes and line.startswith("} else"):
                nodes.append(Block(-1))   # tells the caller that an `else` follows
            return nodes
        if line.startswith("block block_"):
            nodes.append(Block(int(line[12:-1])))
        elif line.startswith("loop {"):
            nodes.append(Loop(_nodes(lines, samplers)))
        elif line.startswith("if "):
            found = _SOURCE.search(line)
            yes = _nodes(lines, samplers)
            if found is None or not isinstance(yes[-1], Block) or yes[-1].number != -1:
                raise NotCountable(_unknown(line))
            nodes.append(Branch(int(found[1]), (yes[:-1], _nodes(lines, samplers))))
        elif line and not line.startswith(("/*", "decl_var")):
            if not nodes or not isinstance(last := nodes[-1], Block):
                raise NotCountable(_unknown(line))
            last.instructions.append(_instruction(line, samplers))
    return nodes


def _instruction(line: str, samplers: dict[int, str]) -> Instruction:
    found = _LINE.fullmatch(line)
    rest = found["rest"] if found else ""
    op = rest.split()[0].rstrip("!") if rest else ""
    if found is None or found["to"] is None and op not in _STATEMENTS:
        raise NotCountable(_unknown(line))
    one = Instruction(op, int(found["to"] or -1), int(found["width"] or 0),
                      int(found["bits"] or 32))
    if op == "load_const":
        words = rest[rest.index("(") + 1:].split("=")[0].split(")")[0].split(",")
        one.bits_of_constant = tuple(
            {"true": 1, "false": 0}.get(w.strip()) if w.strip() in ("true", "false")
            else int(w.strip(), 16) for w in words)
    elif op == "phi":
        pairs = re.findall(r"block_(\d+): ssa_(\d+)", rest)
        one.predecessors = tuple(int(block) for block, _ in pairs)
        one.sources = [(int(value), "") for _, value in pairs]
    elif op == "intrinsic":
        one.op = rest.split()[1]
        inside = rest[rest.index("("):]
        one.sources = [(int(v), s) for v, s in _SOURCE.findall(inside[:inside.index(")")])]
        if base := re.search(r"range_base=(\d+)", rest):
            one.offset = int(base[1])
        if mask := re.search(r"wrmask=([xyzw]+)", rest):
            one.mask = mask[1]
    elif op == "deref_var":
        one.name = rest.split()[1].lstrip("&")
    elif op.endswith("txf"):
        one.op = "txf"
        parts = rest.split(")", 1)[1]
        one.sources = [(int(v), s) for v, s in _SOURCE.findall(parts)][:1]
        number = re.search(r"(\d+) \(sampler\)", rest)
        if number is None:
            raise NotCountable(_unknown(line))
        one.name = samplers[int(number[1])]
    else:
        one.sources = [(int(v), s) for v, s in _SOURCE.findall(rest.split("/*")[0])]
        if op == "deref_array" and (constant := re.search(r"\)\[(\d+)\]", rest)):
            one.offset = int(constant[1])
    return one


def _number(program: Program, nodes: list[Node], parent: int) -> int:
    """Number the region of these nodes and the regions inside it, and count their work."""
    region = len(program.work)
    program.work.append(RegionWork())
    program.parents.append(parent)
    blocks = [node for node in nodes if isinstance(node, Block)]
    program.work[region] = _work([one for block in blocks for one in block.instructions])
    for node in nodes:
        if isinstance(node, Loop):
            node.region = len(program.work)
            program.loops.append(node.region)
            _number(program, node.body, region)
        elif isinstance(node, Branch):
            yes = _number(program, node.sides[0], region)
            node.regions = (yes, _number(program, node.sides[1], region))
    return region


def _work(instructions: list[Instruction]) -> RegionWork:
    """Return the cost of running each of the instructions once. A product that is used only in one
    sum costs nothing, because hardware fuses the two into a multiply-add."""
    uses = Counter(value for one in instructions for value, _ in one.sources)
    made = {one.to: one for one in instructions if one.to >= 0}
    fused: set[int] = set()
    for one in instructions:
        if one.op in ("fadd", "iadd"):
            for value, _ in one.sources:
                while value in made and made[value].op in ("fneg", "ineg") and uses[value] == 1:
                    value = made[value].sources[0][0]
                product = value in made and made[value].op in ("fmul", "imul")
                if product and uses[value] == 1 and value not in fused:
                    fused.add(value)
                    break
    work = RegionWork()
    for one in instructions:
        if one.op == "txf":
            work.fetches[one.name] += 1
        elif one.op not in FREE and one.op not in _NO_ARITHMETIC and one.to not in fused:
            division = one.op == "fdiv"    # a reciprocal and a multiplication
            work.vector += one.width if one.op in _ONE_A_COMPONENT else 1 + division
            work.scalar += _DOTS.get(one.op, one.width) + division
    return work
