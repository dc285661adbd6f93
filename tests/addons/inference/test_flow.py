"""How names flow through a program: each case is a body of ``__init__`` and the names it publishes."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.addons.inference.conftest import Infer

NodeBody = Callable[..., list[str]]

POSITIONAL = (
    "import argparse\np = argparse.ArgumentParser()\np.add_argument({})\nself.P(p.parse_args().topic)"
)
NUMBER = "n = self.declare_parameter('n', {}).value\nself.P({})"

CASES: dict[str, tuple[str, list[str]]] = {
    "constant": ("self.P('a')", ["a"]),
    "variable": ("x = 'a'; x = x + '/b'; self.P(x)", ["a/b"]),
    "f-string": ("x = 'a'; self.P(f'{x}/b{1}')", ["a/b1"]),
    "f-string with a width": ("self.P(f'a{1:02d}')", ["a01"]),
    "format": ("self.P('{}/{n}'.format('a', n='b'))", ["a/b"]),
    "percent": ("self.P('%s_%02d' % ('a', 3))", ["a_03"]),
    "percent with a mapping": ("self.P('%(x)s' % {'x': 'a'})", ["?"]),
    "join": ("self.P('/'.join(['a', 'b']))", ["a/b"]),
    "str and int": ("self.P('a' + str(1))", ["a1"]),
    "methods of str": ("self.P('/A/'.strip('/').lower().replace('a', 'b'))", ["b"]),
    "split": ("self.P('a/b'.split('/')[1])", ["b"]),
    "conditional expression": ("self.P('a' if sys.argv else 'b')", ["a", "b"]),
    "or": ("x = None or 'a'; self.P(x)", ["a"]),
    "branches join": ("x = 'a' if sys.argv[1:] else 'b'\nself.P(x + '/c')", ["a/c", "b/c"]),
    "if": ("x = 'a'\nif sys.argv[1] == 'x':\n    x = 'b'\nself.P(x)", ["a", "b"]),
    "a certain condition": ("D = False\nif D:\n    self.P('a')\nelse:\n    self.P('b')", ["b"]),
    "what an exception ends is not followed": (
        "x = 'a'\ndef f():\n    nonlocal x\n    x = 'b'\n    if sys.argv[1:]:\n        raise ValueError\n    x = 'c'\n"
        "f()\nself.P(x)",
        ["c"],
    ),
    "what is caught may have stopped anywhere": (
        "x = 'a'\ndef f():\n    nonlocal x\n    x = 'b'\n    if sys.argv[1:]:\n        raise ValueError\n    x = 'c'\n"
        "try:\n    f()\nexcept ValueError:\n    pass\nself.P(x)",
        ["a", "b", "c"],
    ),
    "None is filled in": ("x = None\nif x is None:\n    x = 'a'\nself.P(x)", ["a"]),
    "list": ("for x in ['a', 'b']:\n    self.P(x)", ["a", "b"]),
    "pairs": ("for x, y in [('a', 1), ('b', 2)]:\n    self.P(f'{x}{y}')", ["a1", "b2"]),
    "dictionary": ("for k, v in {'a': 'b', 'c': 'd'}.items():\n    self.P(k + v)", ["ab", "cd"]),
    "dictionary item": ("t = {'x': 'a', 'y': 'b'}\nself.P(t['y'])", ["b"]),
    "range": ("for i in range(3):\n    self.P('r%d' % i)", ["r0", "r1", "r2"]),
    "enumerate": ("for i, x in enumerate(['a', 'b']):\n    self.P(f'{i}{x}')", ["0a", "1b"]),
    "zip": ("for x, y in zip(['a', 'b'], ['c', 'd', 'e']):\n    self.P(f'{x}{y}')", ["ac", "bd"]),
    "a dictionary of pairs": ("for x, y in dict([('a', 'b'), ('c', 'd')]).items():\n    self.P(x + y)", ["ab", "cd"]),
    "a dictionary of what may be pairs": ("self.P(dict(sys.argv[1])['a'])", ["?"]),
    "product": (
        "import itertools\nfor x, y in itertools.product('ab', 'c'):\n    self.P(x + y)", ["ac", "bc"]
    ),
    "product with itself": (
        "import itertools\nfor x, y in itertools.product('ab', repeat=2):\n    self.P(x + y)", ["aa", "ab", "ba", "bb"]
    ),
    "zip of parameters": (
        "L = [self.declare_parameter(n, ['a', 'b']).value for n in 'xy']\n"
        "for x, y in zip(L[0], L[1]):\n    self.P(f'{x}{y}')",
        ["?"],
    ),
    "comprehension": ("for x in [f'{y}_t' for y in ('a', 'b')]:\n    self.P(x)", ["a_t", "b_t"]),
    "comprehension with effects": ("self.p = [self.P(x) for x in ('a', 'b')]", ["a", "b"]),
    "dict comprehension": ("self.p = {x: self.P(x) for x in ('a', 'b')}", ["a", "b"]),
    "map and lambda": ("list(map(lambda x: self.P(x + '/t'), ['a', 'b']))", ["a/t", "b/t"]),
    "append": ("x = []\nx.append('a')\nx.append('b')\nfor y in x:\n    self.P(y)", ["a", "b"]),
    "unpacking": ("first, *rest = ['a', 'b', 'c']\nfor y in rest:\n    self.P(y)", ["b", "c"]),
    "arguments from containers": ("x = ['a']\ny = {'name': 'b'}\nself.P(*x)\nself.P(**y)", ["a", "b"]),
    "while with break": ("i = 0\nwhile True:\n    i += 1\n    if i > 3: break\nself.P('a')", ["a"]),
    "growing text is a pattern": ("x = 'a'\nwhile sys.argv[1]:\n    x += 'b'\nself.P(x)", ["a?"]),
    "try": ("x = 'a'\ntry:\n    x = 'b'\n    int(sys.argv[1])\n    x = 'd'\nexcept ValueError:\n    pass\nself.P(x)",
            ["a", "b", "d"]),
    "finally": ("try:\n    x = 'a'\nfinally:\n    self.P('b')\nself.P(x)", ["a", "b"]),
    "written before a break": (
        "x = 'a'\nfor i in range(3):\n    if sys.argv[i]:\n        x = 'b'\n        break\nself.P(x)", ["a", "b"]
    ),
    "written before a break of an unknown loop": (
        "x = 'a'\nfor y in sys.argv:\n    if y:\n        x = 'b'\n        break\nself.P(x)", ["a", "b"]
    ),
    "written before a continue": (
        "x = 'a'\nfor i in range(3):\n    if sys.argv[i]:\n        x = 'b'\n        continue\n    x = 'c'\nself.P(x)",
        ["b", "c"],
    ),
    "written before a return": (
        "self.x = 'a'\ndef f():\n    if sys.argv[1]:\n        self.x = 'b'\n        return\nf()\nself.P(self.x)",
        ["a", "b"],
    ),
    "what every way out of a function writes anew": (
        "self.x = 'a'\ndef f():\n    if sys.argv[1]:\n        self.x = 'b'\n        return\n"
        "    self.x = 'c'\nf()\nself.P(self.x)",
        ["b", "c"],
    ),
    "a way out that finally still changes": (
        "self.x = 'a'\ndef f():\n    try:\n        if sys.argv[1]: return\n        self.x = 'c'\n    finally:\n"
        "        self.x += '/d'\nf()\nself.P(self.x)",
        ["a", "c/d"],
    ),
    "written before a raise": (
        "x = 'a'\ntry:\n    if sys.argv[1]:\n        x = 'b'\n        raise ValueError()\n"
        "except ValueError:\n    pass\nself.P(x)",
        ["a", "b"],
    ),
    "another try, else an error": (
        "for i in range(3):\n    if sys.argv[i]: break\nelse:\n    raise RuntimeError()\nself.P('a')", ["a"]
    ),
    "the else of a loop that a break may leave": (
        "x = 'a'\nfor i in range(3):\n    if sys.argv[i]:\n        x = 'b'\n        break\n"
        "else:\n    x = 'c'\nself.P(x)",
        ["b", "c"],
    ),
    "the else of a loop that a break leaves": (
        "x = 'a'\nfor i in range(3):\n    if i == 2: break\nelse:\n    x = 'c'\nself.P(x)", ["a"]
    ),
    "early return": ("def f():\n    if sys.argv[1]: return 'a'\n    return 'b'\nself.P(f())", ["a", "b"]),
    "closure": ("x = 'a'\ndef f():\n    return x + '/b'\nself.P(f())", ["a/b"]),
    "nonlocal": ("x = 'a'\ndef f():\n    nonlocal x\n    x = 'b'\nf()\nself.P(x)", ["b"]),
    "default argument": ("def f(y='a'):\n    return y\nself.P(f())\nself.P(f('b'))", ["a", "b"]),
    "recursion": ("def f(n):\n    return 'a' if n == 0 else f(n - 1)\nself.P(f(3))", ["?"]),
    "generator": ("def f():\n    yield 'a'\n    yield 'b'\nfor x in f():\n    self.P(x)", ["a", "b"]),
    "getattr": ("self.a = 'x'\nself.P(getattr(self, 'a'))", ["x"]),
    "a class without bases by type()": (
        "s = type('S', (object,), {'topic': 'a'})()\nself.P('b')\nself.P(s.topic)", ["?", "b"]
    ),
    "a copy of __dict__": (
        "class S:\n    def __init__(self): self.topic = 'b'\ns = S()\nd = dict(s.__dict__)\n"
        "self.P(s.topic); self.P(d['topic'])",
        ["?", "b"],
    ),
    "isinstance": ("x = ['a']\nself.P('a' if isinstance(x, (list, tuple)) else 'b')", ["a"]),
    "isinstance of a parameter": (
        "x = self.declare_parameter('x', ['a']).value\nself.P('a' if isinstance(x, str) else 'b')", ["b"]
    ),
    "isinstance of a class of another library": (
        "import numpy\nx = ['a']\nself.P('a' if isinstance(x, (list, numpy.ndarray)) else 'b')", ["a"]
    ),
    "partition": ("self.P('a:b:c'.partition(':')[2])", ["b:c"]),
    "setattr": ("setattr(self, 'a', 'x')\nself.P(self.a)", ["x"]),
    "walrus": ("if (x := 'a'):\n    self.P(x)", ["a"]),
    "match": ("match sys.argv[1]:\n    case 'x':\n        self.P('a')\n    case _:\n        self.P('b')", ["a", "b"]),
    "match of what is known": (
        "x = 2\nmatch x:\n    case 1: self.P('a')\n    case 2 | 3: self.P('b')\n    case _: self.P('c')", ["b"],
    ),
    "match of what one of two is": (
        "x = 2 if sys.argv[1:] else 1\nmatch x:\n    case 1: y = 'a'\n    case 2: y = 'b'\n    case _: y = 'c'\n"
        "self.P(y)", ["a", "b", "c"],
    ),
    "match of None and members": (
        "from enum import Enum\nclass F(Enum):\n    A = 1\n    B = 2\n"
        "x = F.B\nmatch x:\n    case None: self.P('a')\n    case F.A: self.P('b')\n    case F.B: self.P('c')", ["c"],
    ),
    "match with guards": (
        "x = 2\ny = 'z'\nmatch x:\n    case 2 if y == 'a': self.P('a')\n    case _ if y == 'z': self.P('b')\n"
        "    case 2: self.P('c')", ["a", "b", "c"],
    ),
    "match that takes a list apart": (
        "x = ['a', 'b']\nmatch x:\n    case [y]: self.P('c')\n    case [y, z]: self.P(z)", ["?", "c"],
    ),
    "match with a guard that may change it": (
        "def f():\n    self.x = 2\n    return sys.argv[1:]\nself.x = 1\n"
        "match self.x:\n    case 1 if f(): self.P('a')\n    case 1: self.P('b')\n    case 2: self.P('c')", ["a", "b"],
    ),
    "match of what a call gives, which is called once": (
        "def f():\n    self.P('a')\n    return self.x\nself.x = 'b'\n"
        "match f():\n    case 'c': self.P('c')\n    case 'b': self.P('b')", ["a", "b"],
    ),
    "partial": ("import functools\nf = functools.partial(self.P, 'a')\nf()", ["a"]),
    "path join": ("import os\nself.P(os.path.join('a', 'b'))", ["a/b"]),
    "unknown": ("self.P(sys.argv[1])", ["?"]),
    "prefix of unknown": ("self.P('a/' + sys.argv[1])", ["a/?"]),
    "option of argparse": (
        "import argparse\np = argparse.ArgumentParser()\np.add_argument('--topic', default='a')\n"
        "self.P(p.parse_args().topic)",
        ["param:--topic"],
    ),
    "a word of argparse": (POSITIONAL.format("'topic'"), ["?"]),
    "a part of a parameter": ("self.P(self.declare_parameter('x', 'a/b').value.split('/')[0])", ["?"]),
    "an element of a parameter": ("self.P(self.declare_parameter('x', ['a']).value[0] + '/b')", ["param:x/b"]),
    "an edited parameter": ("self.P(self.declare_parameter('x', 'A').value.lower())", ["?"]),
    "a whole number": (NUMBER.format("1", "f'r{n}/a'"), ["rparam:n/a"]),
    "a whole number that is formatted": (NUMBER.format("1", "'r%d/a' % n"), ["r?/a"]),
    "environment": ("import os\nself.P(os.environ.get('TOPIC', 'a'))", ["param:$TOPIC"]),
    "environment without a default": ("import os\nself.P(os.environ['TOPIC'])", ["param:$TOPIC"]),
    "node name in a name": ("self.P(self.get_name() + '/a')", ["{node}/a"]),
    "fully qualified name": ("self.P(self.get_fully_qualified_name() + '/a')", ["~/a"]),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_names_flow(case: str, node_body: NodeBody) -> None:
    body, expected = CASES[case]
    assert node_body(body) == expected


def test_default_of_an_option_is_kept(infer: Callable[..., object], node_body: NodeBody) -> None:
    """Filled with nothing, the symbolic name is its default."""
    from enclave_addons.inference import InferredSystem

    system = infer(
        """
        import argparse, rclpy
        from std_msgs.msg import String
        parser = argparse.ArgumentParser()
        parser.add_argument('--topic', default='a')
        node = rclpy.create_node('n')
        node.create_publisher(String, parser.parse_args().topic, 1)
        """
    )
    assert isinstance(system, InferredSystem)
    (endpoint,) = system.nodes[0].endpoints
    assert endpoint.name.fill({}).text == "a"
    assert endpoint.certainty.value == "from default"
    assert endpoint.name.fill({"--topic": "b"}).text == "b"


OUTSIDE: dict[str, tuple[str, str, str, list[str]]] = {
    "module constant": ("TOPIC = 'a'", "self.P(TOPIC)", "", ["a"]),
    "class attribute": ("", "self.P(self.topic)", "topic = 'a'", ["a"]),
    "a field shadows the class attribute": ("", "self.topic = 'b'\nself.P(self.topic)", "topic = 'a'", ["b"]),
    "a field that may shadow it": (
        "", "if sys.argv[1]:\n    self.topic = 'b'\nself.P(self.topic)", "topic = 'a'", ["a", "b"],
    ),
    "property": ("", "self.P(self.topic)", "@property\ndef topic(self):\n    return 'a'", ["a"]),
    "getattr of a method, and of none": (
        "", "for x in ('a', 'b'):\n    getattr(self, 'make_' + x, self.P)(x)",
        "def make_a(self, x):\n    self.P('made')", ["b", "made"],
    ),
    "getattr of a method that some classes have": (
        "", "getattr(self, 'make', lambda: self.P('b'))()",
        "if sys.argv[1:]:\n    def make(self):\n        self.P('a')", ["a", "b"],
    ),
    "getattr of a field": (
        "", "self.x = 'a'\nif sys.argv[1:]:\n    self.y = 'c'\n"
        "self.P(getattr(self, 'x', 'b'))\nself.P(getattr(self, 'y', 'd'))", "", ["a", "c", "d"],
    ),
    "keyword arguments of two calls": (
        "", "self.f(x='a')\nself.f(x='b', y='c')\nself.f()",
        "def f(self, **k):\n    if k:\n        k['x'] = k['x'] + k.pop('y', '')\n    self.P(k.get('x', 'd'))",
        ["a", "bc", "d"],
    ),
    "which class it is": (
        "class A:\n    T = 'a'\nclass B:\n    T = 'b'",
        "x = A\nx = B if x is A else A\nself.P(x.T)\nself.P(x.T if x != B else 'c')", "", ["b", "c"],
    ),
    "static method": ("", "self.P(self.f('a'))", "@staticmethod\ndef f(x):\n    return x + '/b'", ["a/b"]),
    "class method": ("", "self.P(self.f())", "@classmethod\ndef f(cls):\n    return cls.T\nT = 'a'", ["a"]),
    "dataclass": (
        "from dataclasses import dataclass\n@dataclass\nclass C:\n    x: str\n    y: str = 'b'",
        "c = C('a')\nself.P(c.x + c.y)", "", ["ab"],
    ),
    "enum": (
        "from enum import Enum\nclass E(Enum):\n    X = 'a'\n    Y = 'b'",
        "self.P(E.X.value)\nfor e in E:\n    self.P('all/' + e.value)", "", ["a", "all/a", "all/b"],
    ),
    "a dictionary by members of an enumeration": (
        "from enum import Enum\nclass E(Enum):\n    X = 1\n    Y = 2",
        "self.P({E.X: 'a', E.Y: 'b'}[E.X])\nself.P({E.X: 'c', E.Y: 'd'}.get(E.X))", "", ["a", "c"],
    ),
    "a dictionary by pairs": ("", "self.P({(1, 2): 'a', (1, 3): 'b', 'x': 'c'}[1, 2])", "", ["a", "b", "c"]),
    "timer": ("", "self.create_timer(1.0, self.tick)", "def tick(self):\n    self.P('a')", ["a"]),
    "field set by another callback": (
        "", "self.x = 'a'\nself.create_timer(1.0, self.t1)\nself.create_timer(1.0, self.t2)",
        "def t1(self):\n    self.P(self.x)\ndef t2(self):\n    self.x = 'b'", ["a", "b"],
    ),
    "late lambda": ("", "for x in ('a', 'b'):\n    self.create_timer(1.0, lambda x=x: self.P(x))", "", ["a", "b"]),
    "thread": ("import threading", "threading.Thread(target=self.P, args=('a',)).start()", "", ["a"]),
    "done callback": (
        "", "c = self.create_client(String, 's')\nc.call_async(None).add_done_callback(self.done)",
        "def done(self, future):\n    self.P('a')", ["a", "s"],
    ),
    "decorator": (
        "def twice(f):\n    def g(self):\n        return f(self) + '/b'\n    return g",
        "self.P(self.f())", "@twice\ndef f(self):\n    return 'a'", ["a/b"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", OUTSIDE)
def test_names_from_around_the_constructor(case: str, node_body: NodeBody) -> None:
    before, body, after, expected = OUTSIDE[case]
    assert node_body(body, before, after) == expected


def test_inheritance_across_files(names: Callable[..., list[str]]) -> None:
    base = """
        from rclpy.node import Node
        from std_msgs.msg import String
        class Base(Node):
            suffix = 'base'
            def __init__(self, name, topic='d'):
                super().__init__(name)
                self.create_publisher(String, f'{topic}/{self.suffix}', 1)
    """
    main = """
        import rclpy
        from base import Base
        class Child(Base):
            suffix = 'child'
            def __init__(self):
                super().__init__('child', topic='a')
        rclpy.init()
        Child()
    """
    assert names(main, {"base.py": base}) == ["a/child"]


def test_constants_of_a_package(names: Callable[..., list[str]]) -> None:
    files = {
        "pkg/__init__.py": "",
        "pkg/topics.py": "CMD = 'cmd'\nclass T:\n    ODOM = 'odom'\n",
        "pkg/node.py": """
            import rclpy
            from std_msgs.msg import String
            from . import topics
            from .topics import T
            node = rclpy.create_node('n')
            node.create_publisher(String, topics.CMD, 1)
            node.create_publisher(String, T.ODOM, 1)
        """,
    }
    assert names("", files) == ["cmd", "odom"]


@pytest.mark.parametrize(
    "line", ["import there", "from there import NAME", "from enum import NotInThisRelease"]
)
def test_a_library_that_may_be_missing_leaves_both_outcomes(line: str, names: NodeBody) -> None:
    program = f"""
        import rclpy
        from std_msgs.msg import String
        try:
            {line}
            topic = "with_it"
        except ImportError:
            topic = "without"
        rclpy.create_node("n").create_publisher(String, topic, 10)
        """
    assert names(program) == ["with_it", "without"]


@pytest.mark.parametrize(
    ("option", "parsed", "reads_launch"),
    [
        ("add_argument('--robot')", "", True),
        ("add_argument('--robot')", "sys.argv[1:]", True),
        ("add_argument('--robot')", "['--robot', 'a']", False),
    ],
)
def test_what_argparse_leaves_is_the_launchs_unless_it_takes_words_of_ros(
    option: str, parsed: str, reads_launch: bool, infer: Infer
) -> None:
    program = f"""
        import argparse, rclpy, sys
        from somewhere import some
        parser = argparse.ArgumentParser()
        parser.{option}
        known, rest = parser.parse_known_args({parsed})
        rclpy.init(args=rest)
        rclpy.create_node("n")
        """
    (node,) = infer(program).nodes
    assert any("given in code" in gap.why for gap in node.gaps) is not reads_launch


_HANDED = """
    import rclpy, somewhere
    from std_msgs.msg import String
    node = rclpy.create_node('n')
    def topics():
        for name in ('a', 'b'):
            {body}
    somewhere.register({handed})
    """


@pytest.mark.parametrize(
    ("body", "handed", "made"),
    [
        ("yield name", "topics", []),
        ("yield node.create_publisher(String, name, 1)", "topics()", ["a", "b"]),
        ("yield node.create_publisher(String, name, 1)", "topics", ["a", "b"]),
        ("node.create_publisher(String, name, 1)", "topics", ["a", "b"]),
    ],
    ids=[
        "it creates nothing",
        "the generator itself is handed over",
        "what makes it is",
        "an ordinary function",
    ],
)
def test_what_others_may_run_and_was_followed_is_no_gap(
    body: str, handed: str, made: list[str], infer: Infer
) -> None:
    system = infer(_HANDED.format(body=body, handed=handed))
    assert sorted(str(each.name) for node in system.nodes for each in node.endpoints) == made
    assert (list(system.gaps), [gap for node in system.nodes for gap in node.gaps]) == ([], [])


def test_a_singleton_makes_its_interfaces_in_new(infer: Infer) -> None:
    """As the spawner of ros2_control calls its services."""
    system = infer(
        """
        import rclpy
        from std_srvs.srv import Empty
        class Caller:
            _clients = {}
            def __new__(cls, node, name):
                if name not in cls._clients:
                    cls._clients[name] = node.create_client(Empty, name)
                return super().__new__(cls)
        node = rclpy.create_node('n')
        Caller(node, 'load')
        Caller(node, 'switch')
        """
    )
    (node,) = system.nodes
    assert sorted(str(each.name) for each in node.endpoints) == ["load", "switch"]
    assert not system.gaps and not node.gaps
