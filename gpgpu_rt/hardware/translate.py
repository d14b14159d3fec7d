"""Translate a program to numpy: the source of a Python function over all fragments at once.

Each component is a separate array, so swizzles and moves cost nothing. A mask says which fragments
are active. A value that is computed in a loop and read after it is written only for active
fragments. Any other value is written for all fragments. It may be wrong for inactive fragments,
but they never read it.
"""
from __future__ import annotations

from ..errors import ShaderError
from .program import Block, Branch, Instruction, Loop, Node, Program

_FLOAT, _INT, _BOOL = "f", "i", "b"
_DTYPES = {_FLOAT: "np.float32", _INT: "np.int32", _BOOL: "np.bool_"}

# For each instruction: the types of the operands, the type of the result, and the expression. The
# types are f, i and b as below; the type * is a bool or an int.
_OPS = {
    "fadd": ("ff", "f", "{} + {}"), "fmul": ("ff", "f", "{} * {}"),
    "fdiv": ("ff", "f", "{} / {}"), "frcp": ("f", "f", "ONE / {}"),
    "fneg": ("f", "f", "-{}"), "fabs": ("f", "f", "np.abs({})"),
    "fmin": ("ff", "f", "np.fmin({}, {})"), "fmax": ("ff", "f", "np.fmax({}, {})"),
    "ffloor": ("f", "f", "np.floor({})"), "fceil": ("f", "f", "np.ceil({})"),
    "ftrunc": ("f", "f", "np.trunc({})"), "fsign": ("f", "f", "np.sign({})"),
    "fround_even": ("f", "f", "np.rint({})"), "fsqrt": ("f", "f", "np.sqrt({})"),
    "frsq": ("f", "f", "ONE / np.sqrt({})"), "fsat": ("f", "f", "np.clip({}, 0, ONE)"),
    "flt": ("ff", "b", "{} < {}"), "fge": ("ff", "b", "{} >= {}"),
    "feq": ("ff", "b", "{} == {}"), "fneu": ("ff", "b", "{} != {}"),
    "iadd": ("ii", "i", "{} + {}"), "imul": ("ii", "i", "{} * {}"), "ineg": ("i", "i", "-{}"),
    "iabs": ("i", "i", "np.abs({})"), "isign": ("i", "i", "np.sign({})"),
    "imin": ("ii", "i", "np.minimum({}, {})"), "imax": ("ii", "i", "np.maximum({}, {})"),
    "iand": ("**", "*", "{} & {}"), "ior": ("**", "*", "{} | {}"),
    "ixor": ("**", "*", "{} ^ {}"),
    "inot": ("*", "*", "~{}"), "ishl": ("ii", "i", "{} << {}"), "ishr": ("ii", "i", "{} >> {}"),
    "ushr": ("ii", "i", "({}.view(np.uint32) >> {}.view(np.uint32)).view(np.int32)"),
    "ilt": ("ii", "b", "{} < {}"), "ige": ("ii", "b", "{} >= {}"), "ieq": ("ii", "b", "{} == {}"),
    "ine": ("ii", "b", "{} != {}"),
    "ult": ("ii", "b", "{}.view(np.uint32) < {}.view(np.uint32)"),
    "uge": ("ii", "b", "{}.view(np.uint32) >= {}.view(np.uint32)"),
    "umin": ("ii", "i", "np.minimum({}.view(np.uint32), {}.view(np.uint32)).view(np.int32)"),
    "umax": ("ii", "i", "np.maximum({}.view(np.uint32), {}.view(np.uint32)).view(np.int32)"),
    "b2i32": ("b", "i", "{}.astype(np.int32)"), "b2f32": ("b", "f", "{}.astype(np.float32)"),
    "f2i32": ("f", "i", "{}.astype(np.int32)"), "i2f32": ("i", "f", "{}.astype(np.float32)"),
    "f2u32": ("f", "i", "{}.astype(np.uint32).view(np.int32)"),
    "u2f32": ("i", "f", "{}.view(np.uint32).astype(np.float32)"),
}
_DOTS = {"fdot2": 2, "fdot3": 3, "fdot4": 4}
_COPIES = {"mov", "vec2", "vec3", "vec4", "bcsel", "phi"}   # they copy values of any type


def translate(program: Program) -> str:
    """Return the source of ``run(S, U, x, y, out, arrays, region, look)``.

    ``S`` holds (texels, width) by sampler, ``U`` the uniforms by byte offset, ``x, y`` the texels
    of the fragments, ``out`` the outputs by name and component, and ``arrays`` the local arrays.
    The code calls ``region(k, mask)`` each time that fragments run region k; the mask says which
    fragments. It calls ``look(sampler, at, mask)`` at each fetch, with the indices of the texels.
    """
    return _Translator(program).source()


class _Translator:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.lines: list[str] = []
        self.made: dict[int, Instruction] = {}
        self.paths: dict[int, tuple[int, ...]] = {}
        self.leaves_loop: set[int] = set()
        self.used: dict[int, set[int]] = {}
        self.predecessors: set[int] = set()
        self.masks = 0
        self._study(program.tree, ())
        self._find_what_leaves(program.tree, ())
        self.types = self._types()

    # Analysis -----------------------------------------------------------------------------------

    def _study(self, nodes: list[Node], path: tuple[int, ...]) -> None:
        for node in nodes:
            if isinstance(node, Loop):
                self._study(node.body, (*path, node.region))
            elif isinstance(node, Branch):
                self.used.setdefault(node.condition, set()).add(0)
                for side in node.sides:
                    self._study(side, path)
            else:
                for one in node.instructions:
                    if one.to >= 0:
                        self.made[one.to], self.paths[one.to] = one, path
                    self.predecessors.update(one.predecessors)
                    for at, (value, swizzle) in enumerate(one.sources):
                        self.used.setdefault(value, set()).update(
                            self._components(one, at, swizzle))

    def _components(self, one: Instruction, at: int, swizzle: str) -> list[int]:
        if swizzle:
            return ["xyzw".index(c) for c in swizzle]
        least = 4 if one.op == "store_deref" else _DOTS.get(one.op, 1)
        return list(range(max(one.width, least)))

    def _find_what_leaves(self, nodes: list[Node], path: tuple[int, ...]) -> None:
        for node in nodes:
            if isinstance(node, Loop):
                self._find_what_leaves(node.body, (*path, node.region))
            elif isinstance(node, Branch):
                self._note_use(node.condition, path)
                for side in node.sides:
                    self._find_what_leaves(side, path)
            else:
                for one in node.instructions:
                    for value, _ in one.sources:
                        self._note_use(value, path)

    def _note_use(self, value: int, path: tuple[int, ...]) -> None:
        inside = self.paths.get(value, ())
        if path[:len(inside)] != inside:
            self.leaves_loop.add(value)
            made = self.made[value]      # a copy is only a name: its source leaves the loop, too
            if made.op in ("mov", "vec2", "vec3", "vec4"):
                for source, _ in made.sources:
                    self._note_use(source, path)

    def _types(self) -> dict[int, str]:
        types: dict[int, str] = {}
        copies = [one for one in self.made.values() if one.op in _COPIES]
        for to, one in self.made.items():
            if one.bits == 1:
                types[to] = _BOOL
            elif one.op in _OPS:
                types[to] = _OPS[one.op][1].replace("*", _INT)
            elif one.op == "txf" or one.op in _DOTS:
                types[to] = _FLOAT
            elif one.op == "load_ubo":
                kind = self.program.uniforms[one.offset][1]
                types[to] = _FLOAT if kind.startswith(("float", "vec")) else _INT
            elif one.op == "load_deref":
                name = self._variable(one.sources[0][0])
                types[to] = (_INT if self.program.arrays.get(name, ("float",))[0] == "int"
                             else _FLOAT)
        changed = True
        while changed:
            changed = False
            for one in copies:
                if one.to not in types:
                    found = {types[v] for v, _ in one.sources[one.op == "bcsel":] if v in types}
                    if found:
                        types[one.to] = _FLOAT if _FLOAT in found else _INT
                        changed = True
        for to in self.made:
            types.setdefault(to, _INT)
        return types

    def _variable(self, value: int) -> str:
        one = self.made[value]
        return one.name if one.op == "deref_var" else self._variable(one.sources[0][0])

    # Values -------------------------------------------------------------------------------------

    def _name(self, value: int, component: int) -> str:
        """Return the variable that holds a component, through copies."""
        one = self.made[value]
        if one.op == "mov":
            source, swizzle = one.sources[0]
            return self._name(source, self._at(swizzle, component))
        if one.op in ("vec2", "vec3", "vec4"):
            source, swizzle = one.sources[component]
            return self._name(source, self._at(swizzle, 0))
        return f"v{value}_{component if one.width > 1 else 0}"

    def _root(self, value: int, component: int) -> tuple[int, int]:
        name = self._name(value, component)[1:].split("_")
        return int(name[0]), int(name[1])

    @staticmethod
    def _at(swizzle: str, component: int) -> int:
        return "xyzw".index(swizzle[component]) if swizzle else component

    def _read(self, value: int, swizzle: str, component: int, kind: str) -> str:
        """Return the expression of an operand, converted to a type."""
        root, at = self._root(value, self._at(swizzle, component))
        one = self.made[root]
        if one.op == "load_const":
            bits = one.bits_of_constant[at]
            if kind == _BOOL:
                return f"np.bool_({bits})"
            word = f"np.uint32({bits}).view({_DTYPES[kind]})"
            return self.constants.setdefault(word, f"c{len(self.constants)}")
        name, has = f"v{root}_{at}", self.types[root]
        return name if has == kind else f"{name}.view({_DTYPES[kind]})"

    # Source -------------------------------------------------------------------------------------

    def source(self) -> str:
        self.constants: dict[str, str] = {}
        self._nodes(self.program.tree, "m0", 1, ())
        first = ["def run(S, U, x, y, out, arrays, region, look):",
                 "    n, lanes = len(x), np.arange(len(x))",
                 "    m0 = np.ones(n, bool)", "    came = np.zeros(n, np.int32)",
                 "    region(0, m0)", "    fragment = (x + HALF, y + HALF, HALF, ONE)"]
        for value in sorted(self.leaves_loop | {
                v for one in self.made.values() if one.op == "phi"
                for v, _ in one.sources} | {o.to for o in self.made.values() if o.op == "phi"}):
            one = self.made[value]
            if one.op in ("load_const", "mov", "vec2", "vec3", "vec4", "load_ubo"):
                continue
            for c in range(one.width):
                first.append(f"    v{value}_{c} = np.zeros(n, {_DTYPES[self.types[value]]})")
        first += [f"    {name} = {word}" for word, name in self.constants.items()]
        return "\n".join(first + self.lines) + "\n"

    def _emit(self, depth: int, line: str) -> None:
        self.lines.append("    " * depth + line)

    def _fresh(self) -> str:
        self.masks += 1
        return f"m{self.masks}"

    def _nodes(self, nodes: list[Node], mask: str, depth: int, path: tuple[int, ...]) -> None:
        """Emit nodes; afterwards ``mask`` holds the fragments that are still active."""
        for node in nodes:
            if isinstance(node, Block):
                self._block(node, mask, depth, path)
            elif isinstance(node, Loop):
                inside = self._fresh()
                self._emit(depth, f"{inside} = {mask}.copy()")
                self._emit(depth, f"while {inside}.any():")
                self._emit(depth + 1, f"region({node.region}, {inside})")
                self._nodes(node.body, inside, depth + 1, (*path, node.region))
            else:
                self._branch(node, mask, depth, path)

    def _branch(self, node: Branch, mask: str, depth: int, path: tuple[int, ...]) -> None:
        sides = self._fresh(), self._fresh()
        condition = self._read(node.condition, "", 0, _BOOL)
        self._emit(depth, f"{sides[0]} = {mask} & {condition}")
        self._emit(depth, f"{sides[1]} = {mask} & ~{condition}")
        for side, nodes, region in zip(sides, node.sides, node.regions):
            self._emit(depth, f"if {side}.any():")
            self._emit(depth + 1, f"region({region}, {side})")
            self._nodes(nodes, side, depth + 1, path)
        self._emit(depth, f"{mask} = {sides[0]} | {sides[1]}")

    def _block(self, block: Block, mask: str, depth: int, path: tuple[int, ...]) -> None:
        phis = [one for one in block.instructions if one.op == "phi"]
        values = []
        for one in phis:
            for c in range(one.width):
                kind = self.types[one.to]
                reads = [self._read(v, s, c, kind) for v, s in one.sources]
                text = reads[-1]
                for read, before in list(zip(reads, one.predecessors))[-2::-1]:
                    text = f"np.where(came == {before}, {read}, {text})"
                values.append((f"v{one.to}_{c}", text))
        for name, text in values:
            self._emit(depth, f"new_{name} = {text}")
        for name, _ in values:
            self._assign(name, f"new_{name}", mask, depth)
        for one in block.instructions[len(phis):]:
            self._instruction(one, mask, depth)
        if block.number in self.predecessors:
            self._emit(depth, f"came[{mask}] = {block.number}")
        if block.instructions and block.instructions[-1].op == "break":
            self._emit(depth, f"{mask} = np.zeros(n, bool)")

    def _assign(self, name: str, text: str, mask: str, depth: int) -> None:
        if int(name[1:].split("_")[0]) in self.leaves_loop:
            text = f"np.where({mask}, {text}, {name})"
        self._emit(depth, f"{name} = {text}")

    def _instruction(self, one: Instruction, mask: str, depth: int) -> None:
        components = [c for c in range(one.width) if c in self.used.get(one.to, ())]
        if one.op in _OPS or one.op == "bcsel" or one.op in _DOTS:
            for c in components:
                self._assign(f"v{one.to}_{c}", self._expression(one, c), mask, depth)
        elif one.op == "txf":
            x, y = (self._read(*one.sources[0], c, _INT) for c in (0, 1))
            self._emit(depth, f"texels, width = S[{one.name!r}]")
            self._emit(depth, f"at = clip({y} * width + {x}, len(texels) - 1)")
            self._emit(depth, f"look({one.name!r}, at, {mask})")
            for c in components:
                self._assign(f"v{one.to}_{c}", f"wide(texels[at, {c}], n)", mask, depth)
        elif one.op == "load_ubo":
            for c in components:
                kind = _DTYPES[self.types[one.to]]
                self._emit(depth, f"v{one.to}_{c} = {kind}(U[{one.offset}][{c}])")
        elif one.op == "undefined":
            for c in components:
                self._emit(depth, f"v{one.to}_{c} = np.zeros(n, {_DTYPES[self.types[one.to]]})")
        elif one.op == "load_deref":
            self._load(one, components, mask, depth)
        elif one.op == "store_deref":
            self._store(one, mask, depth)
        elif one.op == "discard_if":
            kept = self._read(*one.sources[0], 0, _BOOL)
            self._emit(depth, f"{mask} = {mask} & ~{kept}")
        elif one.op not in ("load_const", "mov", "vec2", "vec3", "vec4", "deref_var",
                            "deref_array", "break", "phi"):
            raise ShaderError(f"the instruction {one.op} cannot be emulated; write the kernel "
                              "without it, or add it to hardware/translate.py")

    def _expression(self, one: Instruction, c: int) -> str:
        if one.op in _DOTS:
            return " + ".join("{} * {}".format(*(self._read(v, s, part, _FLOAT)
                                                 for v, s in one.sources))
                              for part in range(_DOTS[one.op]))
        if one.op == "bcsel":
            kind = self.types[one.to]
            wanted, text = _BOOL + kind + kind, "np.where({}, {}, {})"
        else:
            kinds, _, text = _OPS[one.op]
            first = self.made[self._root(one.sources[0][0], self._at(one.sources[0][1], 0))[0]]
            if first.bits == 1:        # a comparison of two conditions
                kinds = kinds.replace("i", _BOOL)
            wanted = kinds.replace("*", _BOOL if one.bits == 1 else _INT)
        return text.format(*(self._read(v, s, c, kind)
                             for (v, s), kind in zip(one.sources, wanted)))

    def _load(self, one: Instruction, components: list[int], mask: str, depth: int) -> None:
        place = self.made[one.sources[0][0]]
        if place.op == "deref_array":
            name = self._variable(place.to)
            self._assign(f"v{one.to}_0",
                         f"arrays[{name!r}][np.clip({self._index(place)}, 0, None), lanes]",
                         mask, depth)
            return
        for c in components:   # the fragment's coordinates
            self._assign(f"v{one.to}_{c}", f"fragment[{c}]", mask, depth)

    def _index(self, place: Instruction) -> str:
        """Return the expression of an array element's index."""
        if len(place.sources) == 1:
            return str(place.offset)
        return self._read(*place.sources[1], 0, _INT)

    def _store(self, one: Instruction, mask: str, depth: int) -> None:
        place, (value, swizzle) = self.made[one.sources[0][0]], one.sources[1]
        name = self._variable(place.to)
        if place.op == "deref_array":
            kind = _INT if self.program.arrays[name][0] == "int" else _FLOAT
            at, text = self._index(place), self._read(value, swizzle, 0, kind)
            self._emit(depth, f"arrays[{name!r}][np.broadcast_to({at}, n)[{mask}], lanes[{mask}]]"
                              f" = np.broadcast_to({text}, n)[{mask}]")
            return
        for c in ["xyzw".index(letter) for letter in one.mask]:
            text = self._read(value, swizzle, c, _FLOAT)
            self._emit(depth, f"out[{name!r}][{c}][{mask}] = np.broadcast_to({text}, n)[{mask}]")
