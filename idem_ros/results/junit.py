"""What a gate found as JUnit XML, which every CI server shows."""

from xml.etree import ElementTree

from idem_ros.files.atomic_file import replacing


def write_junit(path, found):
    """Write one test case for each rule, in a suite for each result.

    Args:
        path: the XML file.
        found: {name of a result: [`gate.Finding`]}.

    Raises:
        UnwritableFile: `path` cannot be written.
    """
    root = ElementTree.Element(
        'testsuites', {'name': 'idem gate', **_counts(sum(found.values(), []))}
    )
    for name, findings in found.items():
        name = _printable(name)
        suite = ElementTree.SubElement(root, 'testsuite', {'name': name, **_counts(findings)})
        for finding in findings:
            labels = {'classname': name, 'name': finding.rule.text}
            case = ElementTree.SubElement(suite, 'testcase', labels)
            if not finding.holds:
                message = finding.reason or f'found {finding.value:.6g}'
                ElementTree.SubElement(case, 'failure', {'message': message})
    _write(path, root)


def write_junit_error(path, error):
    """Write one test case that could not be decided: an older file would speak for this gate.

    Raises:
        UnwritableFile: `path` cannot be written.
    """
    counts = {'tests': '1', 'failures': '0', 'errors': '1'}
    root = ElementTree.Element('testsuites', {'name': 'idem gate', **counts})
    suite = ElementTree.SubElement(root, 'testsuite', {'name': 'idem gate', **counts})
    labels = {'classname': 'idem gate', 'name': 'rules and results can be read'}
    case = ElementTree.SubElement(suite, 'testcase', labels)
    ElementTree.SubElement(case, 'error', {'message': _printable(str(error))})
    _write(path, root)


def _write(path, root):
    ElementTree.indent(root)
    with replacing(path) as temporary:
        temporary.write_bytes(ElementTree.tostring(root, encoding='utf-8', xml_declaration=True))


def _counts(findings):
    failures = sum(not finding.holds for finding in findings)
    return {'tests': str(len(findings)), 'failures': str(failures), 'errors': '0'}


def _printable(name):
    """Replace what XML cannot hold: file names may contain anything."""
    return ''.join(letter if letter.isprintable() else '?' for letter in name)
