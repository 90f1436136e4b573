"""URScript in the simulated controller: what programs compute, how threads take turns, what is refused."""

from __future__ import annotations

import re

import pytest

from coneskin.robot.sim.machine.builtins import Builtins
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options, ProgramFailed
from coneskin.robot.sim.urscript.translator import Translation, complete_programs, translate
from coneskin.robot.sim.urscript.values import ScriptError
from tests.robot.sim.program_bench import Bench


def compiled(text: str) -> Translation:
    return translate(text, Builtins.functions())


def started(text: str) -> Controller:
    """A controller that has just started a program, without the cycles of its start delay."""
    controller = Controller(Options(start_delay=0.0))
    controller.program_arrived()
    controller.load(compiled(text))
    return controller


def ints(text: str, cycles: int = 5) -> list[int]:
    """The first output registers after a program ran."""
    controller = started(text)
    for _ in range(cycles):
        controller.update()
    return controller.output_ints[:4]


def program(body: str) -> str:
    return "def main():\n" + body + "\nend\n"


def test_arithmetic_and_logic() -> None:
    body = """
      a = 2 + 3 * 4 - -1     # 15
      b = (2 + 3) * 4 / 2    # 10
      if a > 10 and not (b == 11) or False:
        write_output_integer_register(0, a)
      elif True:
        write_output_integer_register(0, -1)
      else:
        write_output_integer_register(0, -2)
      end
      write_output_integer_register(1, 2 ^ 3 + 7 % 4)
      if True xor True:
        write_output_integer_register(2, 1)
      end
      write_output_integer_register(3, norm([3, 4]))"""
    assert ints(program(body)) == [15, 11, 0, 5]


def test_lists_are_copied_by_assignment_and_elements_are_set() -> None:
    body = """
      a = [1, 2, 3]
      b = a
      b[0] = 7
      def change(list):
        list[1] = 9
        return list[1]
      end
      write_output_integer_register(0, a[0])
      write_output_integer_register(1, b[0])
      write_output_integer_register(2, change(a))
      write_output_integer_register(3, a[1])"""
    assert ints(program(body)) == [1, 7, 9, 2]


def test_functions_have_their_own_variables_and_share_the_global_ones() -> None:
    body = """
      global shared = 1
      mine = 5
      def work(x, y):
        shared = shared + x
        mine = 100
        return mine + y
      end
      write_output_integer_register(0, work(10, y=2))
      write_output_integer_register(1, shared)
      write_output_integer_register(2, mine)"""
    assert ints(program(body))[:3] == [102, 11, 100]


def test_a_function_keeps_to_itself_what_it_declares_local_and_what_the_program_has_not_assigned_before_it() -> None:
    body = """
      mine = 5
      def work():
        local mine = 100
        later = 100
        return mine + later
      end
      later = 7
      write_output_integer_register(0, work())
      write_output_integer_register(1, mine)
      write_output_integer_register(2, later)"""
    assert ints(program(body))[:3] == [200, 5, 7]


def test_threads_take_turns_and_can_be_killed_and_joined() -> None:
    body = """
      global count = 0
      global done = 0
      thread counter():
        while True:
          count = count + 1
          sync()
        end
      end
      thread short():
        sync()
        sync()
        done = 1
      end
      t = run counter()
      s = run short()
      join s
      kill t
      write_output_integer_register(0, done)
      write_output_integer_register(1, count)
      sync()
      sync()
      write_output_integer_register(2, count)"""
    done, at_kill, after, _ = ints(program(body), 10)
    assert done == 1
    assert at_kill == after == 3  # its own turn in each of the three cycles that short took


def test_a_critical_section_holds_nobody_up_while_its_thread_waits() -> None:
    # the program of Universal Robots' driver reads its socket in one, and goes on to the next without a pause
    body = """
      global count = 0
      thread counter():
        while True:
          enter_critical
          count = count + 1
          sync()
          exit_critical
        end
      end
      run counter()
      while count < 3:
        enter_critical
        sync()
        exit_critical
      end
      write_output_integer_register(0, count)"""
    assert ints(program(body), 20)[0] == 3


def test_parameters_have_defaults_that_are_found_at_the_call() -> None:
    body = """
      step = 4
      def work(x, y=2 * 3, z=step, text="a, (b"):
        if text == "a, (b":
          return x + y * 10 + z * 100
        end
        return 0
      end
      write_output_integer_register(0, work(1))
      write_output_integer_register(1, work(1, z=5))
      step = 7
      write_output_integer_register(2, work(1, 2))
      write_output_integer_register(3, work(1, 2, 3, "c"))"""
    assert ints(program(body)) == [461, 561, 721, 0]


@pytest.mark.parametrize("parameters", ["a, a", "1", "a b", "a=", "a=2 b", ","])
def test_parameters_that_are_none_are_refused(parameters: str) -> None:
    with pytest.raises(ScriptError, match="line 2"):
        compiled(program(f"def f({parameters}):\nend"))


def test_a_line_goes_on_while_a_bracket_is_open_and_after_a_logical_operator() -> None:
    body = """
      a = 3
      if a == 1 or   # a comment
        a == 3 and
        not (a == 2):
        write_output_integer_register(0, norm([3,

          4]
        ))
      end
      b = "(["   # brackets of a text open nothing
      write_output_integer_register(1, str_len(str_cat(b,
        str_cat("#", ")"))))"""
    assert ints(program(body))[:2] == [5, 4]


def test_what_polyscope_marks_its_place_with_is_left_out() -> None:
    body = """
      $ 1 "Robot Program"
      write_output_integer_register(0, 1)
      $ 2 "a = ("
      write_output_integer_register(1, 2)"""
    assert ints(program(body))[:2] == [1, 2]
    programs, _ = complete_programs('$ 1 "x"\ndef a():\n  $ 2 "y"\nend\n$ 3 "z"\n')
    assert [p.count("def a") for p in programs] == [1]


def test_sleep_takes_its_cycles() -> None:
    text = program("sleep(0.01)\nwrite_output_integer_register(0, 1)")
    assert ints(text, 5)[0] == 0
    assert ints(text, 7)[0] == 1


def test_break_continue_return_and_halt() -> None:
    body = """
      n = 0
      k = 0
      while True:
        n = n + 1
        if n < 5:
          continue
        end
        if n > 7:
          break
        end
        k = k + 1
      end
      write_output_integer_register(0, k)
      halt
      write_output_integer_register(1, 1)"""
    assert ints(program(body))[:2] == [3, 0]


def test_a_value_may_stand_at_the_start_of_the_next_line() -> None:
    # ur_rtde writes its register offsets like this
    body = "global first = # float register offset\n24    global second = # int register offset\n0    third = 7"
    body += "\nwrite_output_integer_register(0, first + second + third)"
    assert ints(program(body))[0] == 31


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def main():\n  x = \n  y = 1\nend", "line 3: '=' is unexpected in 'y = 1'"),
        ("def main():\n  explode(3)\nend", "line 2: the controller has no function explode in 'explode(3)'"),
        ("def main():\n  x = time()\nend", "no function time (URScript, but not simulated)"),
        ("def main():\n  if True\n    x = 1\n  end\nend", "line 2: expected ':', got the end of the line in 'if True'"),
        ("def main():\n  while True:\n    sync()\nend", "a block has no 'end'"),
        ("def main():\n  x = 3 $ 4\nend", "is not URScript"),
        ("def main():\n  x = (3\nend", "line 2"),
        ("def main():\n  break\nend", "line 2: break stands outside of a loop"),
        ("def main():\n  x = struct(1)\nend", "a member of a struct needs a name"),
        ("def main():\n  switch 1:\n    x = 2\n  end\nend", "line 2: expected 'end', got the end of the line"),
    ],
)
def test_a_text_that_is_not_a_program_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(ScriptError, match=re.escape(words)):
        compiled(text)


def test_python_cannot_be_reached_from_a_program() -> None:
    for line in ("__import__('os')", "x = ().__class__", "open('x')"):
        with pytest.raises(ScriptError):
            compiled(program(line))


def test_a_loop_without_sync_is_preempted_and_other_threads_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the manual's page "Thread scheduling" has it: such a thread is not allowed to run until the next frame."""
    monkeypatch.setattr("coneskin.robot.sim.machine.program._MAX_TURN_TIME", 60.0)  # turns count, on any computer
    body = """
      global count = 0
      thread counter():
        while True:
          count = count + 1
          write_output_integer_register(0, count)
          sync()
        end
      end
      def recursive(n):
        if n == 0:
          return 1
        end
        return recursive(n - 1) + recursive(n - 1)
      end
      thread busy():
        recursive(50)
      end
      run counter()
      run busy()
      while True:
        x = 1
      end"""
    controller = started(program(body))
    for _ in range(5):
        controller.update()
    assert controller.program is not None
    assert controller.output_ints[0] == 5


def test_a_wait_of_less_than_a_cycle_is_one() -> None:
    turn = "sleep(0.001)\n n = n + 1\n write_output_integer_register(0, n)"
    body = f"n = 0\nwhile get_digital_in(0) == False:\n {turn}\nend"
    assert ints(program(body), 5)[0] == 4


def test_programs_are_cut_out_of_the_stream() -> None:
    text = "stopj(2)\ndef a():\n  if x:\n    y = 1\n  end\nend\nsec b():\n  z = 1\nend\ndef c():\n  sync()\n"
    programs, rest = complete_programs(text)
    assert [p.strip().partition("\n")[0] for p in programs] == ["stopj(2)", "def a():", "sec b():"]
    assert rest == "def c():\n  sync()\n"
    for cut in range(len(text)):  # any chopping
        first, left = complete_programs(text[:cut])
        second, end = complete_programs(left + text[cut:])
        assert (first + second, end) == (programs, rest)


def test_a_variable_called_p_is_not_a_pose() -> None:
    body = """
      def first(p):
        p[0] = p[0] + 1
        return p[0]
      end
      write_output_integer_register(0, first(p[4, 0, 0, 0, 0, 0]))"""
    assert ints(program(body))[0] == 5


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        ("global a = [1, 2]\ndef f():\n return a\nend\nb = f()\nb[0] = 9\nx = a[0]", 1),  # a returned list is a copy
        ("a = [[1, 2], [3, 4]]\nrow = a[0]\nrow[1] = 9\nx = a[0, 1]", 2),
        ("m = [[1, 2], [3, 4], [5, 6]]\nm[2, 1] = 20\nx = m[2, 1] + m[2][0]", 25),
        ("m = [[1, 2], [3, 4]] * [10, 20]\nx = m[1]", 110),
        ("x = 0\nif ! False:\n x = 1\nend", 1),
        ("assert(1 < 2)\nx = 3", 3),
        ("def f():\n return None\nend\nx = 0\nif f() == None:\n x = 4\nend", 4),
        ("x = 0xfF + 0x1", 256),
        ("x = 0\nswitch 2:\n case 1:\n  x = 1\n case 1 + 1:\n  x = 5\n default:\n  x = 7\nend", 5),
        ("x = 0\nswitch (x):\n case 1:\n  x = 1\n default:\n  x = 6\nend", 6),
        ("s = struct(a = 1, pose = p[1, 2, 3, 0, 0, 0])\nt = s\nt.a = 5\nt.pose[0] = 7\n"
         "x = s.a + 10 * t.a + t.pose[0]", 58),
        ("s = struct(list = make_list(0, 0, 5))\ns.list.append(4)\ns.list.append(5)\n"
         "x = s.list.pop() + s.list.length()", 6),
        ("global l = make_list(0, 0, 9)\ndef f():\n l.append(8)\nend\nf()\nx = l[0] + l.length()", 9),
        ("def f(a):\n a[0] = 9\n return a[0]\nend\nb = [1]\nx = f(b) + b[0]", 10),
        ("x = to_num(str_sub('12', 0, 1)) y = 2 x = x + y", 3),  # statements of one line
        ("global l = [1, 2]\nthread t(a):\n sync()\n write_output_integer_register(0, a[0])\nend\n"
         "h = run t(l)\nl[0] = 5\njoin h\nx = read_output_integer_register(0)", 1),
    ],
)  # fmt: skip
def test_a_construct_of_the_language(body: str, wanted: int) -> None:
    assert ints(program(f"{body}\nwrite_output_integer_register(0, x)"))[0] == wanted


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("x = 1\ny = 1 / 0", "line 3: ZeroDivisionError: division by zero in 'y = 1 / 0'"),
        ("assert(1 > 2)", "line 2: assertion failed in 'assert(1 > 2)'"),
        ("x = [1, 2]\nx[2] = 1", "line 3: a list of 2 has no element 2 in 'x[2] = 1'"),
        ("x = [1][-1]", "line 2: a list of 1 has no element -1 in"),
        ("def f():\n return nothing\nend\nx = f()", "line 3: the variable nothing has no value in 'return nothing'"),
        ("x = struct(a = 1)\ny = x.b", "line 3: struct(a=1) has no member b in 'y = x.b'"),
        ("movej([0, 0, 0, 0, 0])", "line 2: joint positions must be 6 numbers"),
    ],
)
def test_a_program_that_fails_names_its_line(body: str, words: str) -> None:
    bench = Bench(start_delay=0.0)
    bench.send(program(body))
    bench.step(2)
    assert words in bench.events("abort")[0]["reason"]
    (failed,) = [notice for notice in bench.controller.notices if isinstance(notice, ProgramFailed)]
    assert words.startswith(f"line {failed.line}: {failed.text}"[: len(words)])


def test_a_def_and_its_call_in_one_send_are_one_program() -> None:
    text = "def helper():\n  return 7\nend\ndef prog():\n  write_output_integer_register(0, helper())\nend\nprog()\n"
    programs, rest = complete_programs("stopj(2)\n" + text)
    assert (len(programs), rest) == (2, "")
    assert ints(programs[1])[0] == 7
    assert complete_programs("sec s():\n  x = 1\nend\nf(1)\n")[0] == ["sec s():\n  x = 1\nend\n", "f(1)\n"]
    assert complete_programs("if x: y = 1 end\nz = 1\n")[0] == ["if x: y = 1 end\n", "z = 1\n"]


def test_a_text_of_functions_and_statements_is_a_program() -> None:
    text = "def f(x):\n  return x + y\nend\nglobal y = 4\nwrite_output_integer_register(0, f(3))"
    assert ints(text)[0] == 7
