"""Structs of OMG IDL, as far as messages of ROS need them, read token by token."""

import re

from idem_ros.core.exceptions import IdemError

TOKEN = re.compile(
    r'"(?:[^"\\]|\\.)*"|(?:::)?[A-Za-z_]\w*(?:::\w+)*|\d[\w.]*|[^\s\w]', re.ASCII | re.DOTALL
)
COMMENT = re.compile(r'//[^\n]*|/\*.*?\*/|^\s*#[^\n]*|^={20,}\s*$|^IDL: [^\n]*', re.S | re.M)
WORDS = {
    'boolean': 'int8',
    'octet': 'int8',
    'char': 'int8',
    'short': 'int16',
    'float': 'float32',
    'double': 'float64',
    'string': 'string',
    'wstring': 'wstring',
    **{f'{sign}int{bits}': f'int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64)},
}
DEEPEST = 8  # modules in modules, sequences of sequences


class UnreadableIdl(IdemError):
    """IDL that this reader of messages cannot follow."""


def parse_idl(text):
    """Return {type: [(field, its type)]}, see `definitions.parse`.

    Raises:
        UnreadableIdl: in one line.
    """
    return _Parser(TOKEN.findall(COMMENT.sub(' ', text))).types()


class _Parser:
    """Where it is in the tokens, and what it has found."""

    def __init__(self, tokens):
        self._tokens = tokens
        self._at = 0
        self._modules = []
        self._named = {}  # of typedefs and enums: their types; of constants: their numbers
        self._types = {}

    def types(self):
        while self._at < len(self._tokens):
            self._declaration(self._next())
        return self._types

    def _declaration(self, token):
        take = {
            '@': self._annotation,
            'module': self._open_module,
            '}': self._close_module,
            'struct': self._struct,
            'typedef': self._typedef,
            'const': self._constant,
            'enum': self._enum,
            ';': lambda: None,
        }.get(token)
        if take is None:
            raise UnreadableIdl(f'it has {token[:40]!r} where a declaration should begin')
        take()

    def _open_module(self):
        self._modules.append(self._next())
        if len(self._modules) > DEEPEST:
            raise UnreadableIdl(f'it has modules {DEEPEST} deep')
        self._expect('{')

    def _close_module(self):
        if not self._modules:
            raise UnreadableIdl('it closes a module that is not open')
        self._modules.pop()

    def _typedef(self):
        self._named.update({self._scoped(name): kind for name, kind in self._members()})

    def _enum(self):
        self._named[self._scoped(self._next())] = 'int32'
        self._skip_past('}')

    def _struct(self):
        name = self._scoped(self._next())
        fields = self._types[name] = []
        self._expect('{')
        while (token := self._next()) != '}':
            if token == '@':
                self._annotation()
            elif token != ';':
                self._at -= 1
                fields.extend(self._members())

    def _members(self):
        """Return [(name, type)] of `TYPE NAME[N], NAME;`."""
        kind, found = self._type(), []
        while True:
            name, of_this = self._next(), kind
            while self._peek() == '[':
                self._next()
                of_this = ('array', of_this, self._length())
                self._expect(']')
            found.append((name, of_this))
            if self._next() == ';':
                return found

    def _type(self, depth=0):
        if depth > DEEPEST:
            raise UnreadableIdl(f'it has sequences {DEEPEST} deep')
        word = self._next()
        if word == 'sequence':
            self._expect('<')
            kind = ('sequence', self._type(depth + 1))
            self._skip_past('>')
            return kind
        if word in ('string', 'wstring') and self._peek() == '<':
            self._skip_past('>')
        if word == 'unsigned':
            word = self._next()
        if word == 'long':
            is_long = self._peek() == 'long'
            self._at += is_long
            return 'int64' if is_long else 'int32'
        return WORDS.get(word) or self._resolved(word)

    def _resolved(self, word):
        name = word.removeprefix('::').replace('::', '/')
        for candidate in (self._scoped(name), name):
            if candidate in self._named:
                return self._named[candidate]
        return 'name', name if '/' in name else self._scoped(name)

    def _length(self):
        word = self._next()
        number = self._named.get(self._scoped(word), word)
        if not str(number).isdigit():
            raise UnreadableIdl(f'it has an array of length {str(number)[:40]!r}')
        return int(str(number)[:18])

    def _constant(self):
        """Keep a number; any other value is of no use, however it is written."""
        self._type()
        name = self._next()
        self._expect('=')
        value = self._next()
        self._named[self._scoped(name)] = value
        if value != ';':
            self._skip_past(';')

    def _annotation(self):
        self._next()
        if self._peek() == '(':
            depth = 0
            while True:
                token = self._next()
                depth += (token == '(') - (token == ')')
                if not depth:
                    return

    def _skip_past(self, end):
        while self._next() != end:
            pass

    def _expect(self, token):
        if (found := self._next()) != token:
            raise UnreadableIdl(f'it has {found[:40]!r} where {token!r} should be')

    def _peek(self):
        return self._tokens[self._at] if self._at < len(self._tokens) else ''

    def _next(self):
        if self._at >= len(self._tokens):
            raise UnreadableIdl('it ends too early')
        self._at += 1
        return self._tokens[self._at - 1]

    def _scoped(self, name):
        return '/'.join([*self._modules, name])
