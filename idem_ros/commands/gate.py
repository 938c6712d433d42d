"""`idem gate`: hold results of replays to rules, for CI to decide by."""

from idem_ros.commands.inputs import add_results, refuse_files_named_twice
from idem_ros.commands.output_names import require_outputs
from idem_ros.core.exceptions import IdemError
from idem_ros.terminal.command_line import FAILED, OK, UsageError
from idem_ros.terminal.printable import printable

DESCRIPTION = """\
Hold each RESULT of `idem replay` (of --json or --out) to the rules of a YAML file,
print every rule with the value found, and say by the exit code whether all hold:

  rules:
    - translation_error_m.p90 < 0.05
    - time_ms.p95 < 100
    - status.converged >= 0.95
    - verdict.aligned >= 0.9
    - frames >= 20
    - dropped == 0

A rule is NAME[.STATISTIC] OP NUMBER. OP: < <= > >= == !=. NAME:

  frames refused dropped unpaired   counts; without a statistic
  status.converged verdict.aligned  and their like: the share of the frames that ended,
                                    or were judged, so
  interrupted files_missing files_unreadable files_damaged files_extra
  chunks_left_out messages_left_out
                                    counts of what is not in the result; all but files_extra
                                    must be 0 unless a rule speaks of them
  any number of a frame, as in the file: translation_error_m, rotation_error_deg
  (each also with _before, at the guess), q_tot, q_mean, overlap, time_ms ...
  with one of mean median min max count p1 .. p99.9

Frames of which a number is unknown are left out of its statistic (its count says
how many are left). Where it is unknown in all of them (no ground truth), the rule
fails. Exit code: 0 all rules hold, 1 one fails or a RESULT cannot be read, 2 the
rules or the command line are wrong.
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'gate',
        help='hold results to rules: exit code 0 or 1, JUnit XML',
        description=DESCRIPTION,
        epilog='example: idem gate result.json --rules rules.yaml --junit gate.xml',
    )
    add_results(parser)
    parser.add_argument('--rules', metavar='FILE', required=True, help='YAML with a list rules')
    parser.add_argument(
        '--junit',
        metavar='FILE',
        help='write JUnit XML: a test case a rule; one with an error where nothing can be said',
    )
    parser.set_defaults(run=run)


def run(args):
    """Check, print, write; the exit code is the verdict."""
    from idem_ros.results.gate import (
        BadRules,
        findings,
        read_rules,
        write_junit,
        write_junit_error,
    )
    from idem_ros.results.result_file import read_result

    refuse_files_named_twice([*args.results, args.rules])
    require_outputs(args, [('--junit', args.junit)], [*args.results, args.rules])
    try:
        rules = read_rules(args.rules)
        results = [read_result(path) for path in args.results]
        found = dict(zip(args.results, findings(rules, results), strict=True))
    except IdemError as error:
        if args.junit:
            write_junit_error(args.junit, error)
        if isinstance(error, BadRules):
            raise UsageError(str(error)) from error
        raise
    if args.junit:
        write_junit(args.junit, found)
    print('\n'.join(_lines(found)))
    return OK if all(finding.holds for each in found.values() for finding in each) else FAILED


def _lines(found):
    """Yield a table for each result: verdict, rule, value found."""
    for path, findings in found.items():
        width = max(len(finding.rule.text) for finding in findings)
        held = sum(finding.holds for finding in findings)
        yield printable(f'{path}: {held} of {len(findings)} rules hold')
        for finding in findings:
            verdict = 'pass' if finding.holds else 'FAIL'
            value = finding.reason or f'{finding.value:.6g}'
            yield f'  {verdict}  {finding.rule.text:{width}}  {value}'
