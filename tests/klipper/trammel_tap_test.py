"""The extra's rules for taps, retries, scrubs and errors; without Klipper and the library."""
import json
import math
import os
import sys
import tempfile
import threading
import types
import unittest
from unittest import mock

import fake_klipper
import trammel_tap
from trammel_tap import analyser, tapping
from trammel_tap.library import Answer, TapError, open_library
from trammel_tap.load_cell_probe import PROBE_NAMES, LoadCellProbe

GOOD = Answer('good', 'none', '', .05, 5e-4, (.049, .051), 97., 2.)


def refused(reason):
    return Answer('refused', reason, "Sentence.")


class Library:
    """Answers as told, the last answer for ever; raises what is an exception."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.taps = []

    def analyse(self, tap, context):
        self.taps.append((tap, context))
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, BaseException):
            raise answer
        return answer


class Scrub:
    def __init__(self, toolhead, shift=0.):
        self.toolhead, self.shift, self.heights = toolhead, shift, []

    def run_gcode_from_command(self):
        self.heights.append(self.toolhead.position[2])
        self.toolhead.position[0] += self.shift


class TappingTest(unittest.TestCase):
    def setUp(self):
        self.printer = fake_klipper.Printer()
        self.toolhead = self.printer.toolhead
        self.own = "Klipper's own"
        self.probe = self.printer.objects['load_cell_probe']
        logging = mock.patch('logging.exception')
        logging.start()
        self.addCleanup(logging.stop)

    def make(self, *answers, scrub=None, **changes):
        settings = tapping.Settings(.2, None, 3, math.nan, None, scrub)._replace(**changes)
        self.library = Library(*answers)
        return tapping.Tapping(self.printer, settings, LoadCellProbe(self.probe), self.library)

    def run_tap(self, gcmd=None):
        """As Klipper does: through the object that the extra has changed."""
        return self.probe._tapping_move.run_tap(gcmd or fake_klipper.GCodeCommand())

    def fails(self, gcmd=None):
        with self.assertRaises(fake_klipper.CommandError) as caught:
            self.run_tap(gcmd)
        return str(caught.exception)

    def test_the_contact_takes_the_place_of_the_trigger(self):
        self.make(GOOD)
        self.assertEqual(self.run_tap(), ([100., 100., .05, 0.], True))
        self.assertEqual(self.probe._tapping_move._last_result, .05)

    def test_the_nozzle_is_pulled_back_before_the_tap_is_analysed(self):
        self.make(GOOD)
        self.run_tap()
        (coord, speed), = self.toolhead.moves
        self.assertAlmostEqual(coord[2], .21)
        self.assertAlmostEqual(speed, .32)  # 1 um per sample at 320 per second

    def test_samples_and_moves_are_those_of_the_tap(self):
        self.make(GOOD)
        end = self.toolhead.time + 1.
        self.run_tap()
        (tap, context), = self.library.taps
        self.assertGreaterEqual(tap.times[0], end - .2 / .32 - tapping.APPROACH_S)
        self.assertLess(tap.times[0], end - .2 / .32 - tapping.APPROACH_S + .02)
        self.assertEqual([m.z_r for m in tap.moves], [-1., 1.])
        self.assertEqual(context.trigger_force, 75.)
        self.assertTrue(math.isnan(context.latency) and math.isnan(context.nozzle_temperature))

    def test_a_stated_latency_may_be_negative_and_is_known_to_half_a_sample(self):
        self.make(GOOD, latency=-.003)
        self.run_tap()
        context = self.library.taps[0][1]
        self.assertEqual(context.latency, -.003)
        self.assertAlmostEqual(context.latency_uncertainty, 1. / (math.sqrt(12.) * 320.))

    def test_a_refused_tap_is_lifted_and_repeated(self):
        self.make(refused('no_break'), GOOD)
        gcmd = fake_klipper.GCodeCommand()
        self.assertEqual(self.run_tap(gcmd)[0][2], .05)
        self.assertEqual(self.toolhead.moves[1], ([None, None, .01 + .2 + 2.], 5.))
        self.assertIn("refused, no_break: Sentence.", gcmd.said[0])

    def test_retries_end_with_an_error_that_names_the_reason_and_a_lifted_nozzle(self):
        made = self.make(refused('fouled_nozzle'))
        self.assertIn("no contact height after 4 taps. The last: refused, fouled_nozzle",
                      self.fails())
        self.assertEqual(len(self.library.taps), 4)
        self.assertGreaterEqual(self.toolhead.position[2], 2.)
        self.assertEqual(made.get_status(0.)['refused'], 4)
        self.assertFalse(self.probe._tapping_move._is_last_result_valid)

    def test_plastic_is_scrubbed_off_above_the_bed_and_noise_is_not(self):
        scrub = Scrub(self.toolhead)
        self.make(refused('adhesion'), refused('no_break'), GOOD, scrub=scrub)
        self.run_tap()
        self.assertEqual(len(scrub.heights), 1)
        self.assertGreaterEqual(scrub.heights[0], 2.)

    def test_a_scrub_that_does_not_come_back_is_an_error(self):
        self.make(refused('adhesion'), GOOD, scrub=Scrub(self.toolhead, shift=.01))
        self.assertIn("scrub_gcode must end where it began", self.fails())

    def test_samples_in_which_the_sensor_failed_are_not_analysed(self):
        self.make(GOOD)
        self.probe.sensor_errors = [(3, 1)]
        self.run_tap()
        self.assertEqual(len(self.library.taps), 1)
        self.assertEqual(len(self.probe.collectors), 2)

    def test_without_a_trigger_the_nozzle_is_lifted_and_the_collection_ended(self):
        self.make(GOOD)
        self.probe.failure = fake_klipper.CommandError("No trigger on probe after full movement")
        self.assertIn("No trigger", self.fails())
        self.assertEqual(self.toolhead.position[2], 2.)
        self.assertTrue(self.probe.collectors[0].stopped)

    def test_a_pull_back_that_fails_ends_the_collection(self):
        self.make(GOOD)
        self.toolhead.top = .1
        self.assertIn("Move out of range", self.fails())
        self.assertTrue(self.probe.collectors[0].stopped)

    def test_a_bug_is_an_error_of_the_command_with_the_nozzle_lifted(self):
        for bug in (KeyError("of the analysis"), MemoryError()):
            self.toolhead.position[2] = 2.
            self.make(bug)
            self.assertIn("trammel_tap", self.fails())
            self.assertGreaterEqual(self.toolhead.position[2], 2.)
        self.probe.failure = ZeroDivisionError("of the press")
        self.assertIn("of the press", self.fails())

    def test_a_contact_beside_the_pull_back_is_an_error(self):
        for z in (-.2, .4):  # the pull-back goes from 0.01 to 0.21
            self.toolhead.position[2] = 2.
            self.make(GOOD._replace(z=z))
            self.assertIn("makes no sense", self.fails())
            self.assertGreaterEqual(self.toolhead.position[2], 2.)

    def test_a_printer_that_shut_down_is_not_moved(self):
        self.make(GOOD)
        self.printer.shutdown = True
        self.probe.failure = fake_klipper.CommandError("Printer is shutdown")
        self.fails()
        self.assertEqual(self.toolhead.moves, [])

    def test_a_lift_that_fails_does_not_hide_the_error_before_it(self):
        self.make(refused('no_break'), retries=0)
        self.toolhead.top = 1.
        self.assertIn("no_break", self.fails())

    def test_the_first_touch_of_g28_is_klippers_and_the_second_is_not_scrubbed(self):
        scrub = Scrub(self.toolhead)
        self.make(refused('adhesion'), GOOD, scrub=scrub)
        first = fake_klipper.GCodeCommand('G28', HOME_ATTEMPT_NUM='1')
        self.assertEqual(self.run_tap(first), (self.own, True))
        self.assertEqual(self.toolhead.moves, [])
        second = fake_klipper.GCodeCommand('G28', HOME_ATTEMPT_NUM='2')
        self.assertEqual(self.run_tap(second)[0][2], .05)
        self.assertEqual(scrub.heights, [])

    def test_klippers_batch_mode_has_no_samples_and_taps_by_itself(self):
        self.make(GOOD)
        self.printer.start_args = {'debugoutput': 'out'}
        self.assertEqual(self.run_tap(), (self.own, True))

    def test_parameters_of_the_command_hold_for_it(self):
        self.make(refused('no_break'))
        gcmd = fake_klipper.GCodeCommand(PULLBACK_DISTANCE=.5, PULLBACK_SPEED=.1, TAP_RETRIES=0)
        self.fails(gcmd)
        self.assertEqual(self.toolhead.moves[0], ([None, None, .51], .1))
        self.assertEqual(len(self.library.taps), 1)

    def test_a_pull_back_that_takes_too_long_is_refused_before_anything_moves(self):
        self.make(GOOD)
        gcmd = fake_klipper.GCodeCommand(PULLBACK_DISTANCE=1., PULLBACK_SPEED=.05)
        self.assertIn("takes longer than 10 s", self.fails(gcmd))
        self.assertEqual((self.toolhead.moves, self.probe.collectors), ([], []))

    def test_a_pull_back_whose_numbers_are_none_is_refused_before_anything_moves(self):
        for name in ('PULLBACK_DISTANCE', 'PULLBACK_SPEED'):
            self.make(GOOD)
            self.assertIn("nan", self.fails(fake_klipper.GCodeCommand(**{name: math.nan})))
            self.assertEqual((self.toolhead.moves, self.probe.collectors), ([], []))

    def test_a_fast_sensor_is_not_pulled_back_faster_than_a_press_can_be_seen(self):
        self.make(GOOD)
        self.probe._load_cell.sensor.get_samples_per_second = lambda: 2000
        self.run_tap()
        self.assertAlmostEqual(self.toolhead.moves[0][1], .5)

    def test_the_status_is_json_whatever_came(self):
        made = self.make(refused('no_break'), GOOD)
        for _ in range(3):
            json.dumps(made.get_status(0.), allow_nan=False)
            self.run_tap()
        self.assertEqual(made.get_status(0.)['last_interval_lo'], .049)

    def test_taps_are_sent_with_their_moves_to_clients_of_dump_taps(self):
        self.make(GOOD)
        self.probe._tapping_move._clients.client_cbs.append(None)
        self.run_tap()
        tap = json.loads(json.dumps(self.probe.sent[0]))['tap']
        self.assertEqual(len(tap['time']), len(tap['force']))
        self.assertEqual(tap['moves'][1]['z_r'], 1.)
        self.assertEqual(tap['tap_pos'], [100., 100., .05])


    def test_a_library_that_hangs_is_given_up_and_klipper_probes_by_itself(self):
        release = threading.Event()
        self.addCleanup(release.set)
        made = self.make(GOOD)
        self.library.analyse = lambda tap, context: release.wait(10.) and GOOD
        with mock.patch.object(made._analyser, '_limit', .05):
            self.assertIn("took longer", self.fails())  # no mesh of two kinds of heights
            self.assertGreaterEqual(self.toolhead.position[2], 2.)
        for _ in range(3):
            self.assertEqual(self.run_tap(), (self.own, True))
        self.assertEqual(len([t for t in self.printer.said if t.startswith('!! ')]), 1)
        self.assertIn("the library hangs", self.printer.said[-1])
        self.assertIn("hangs", made.get_status(0.)['trouble'])
        self.assertFalse(made.get_status(0.)['active'])

    def test_an_analysis_that_was_only_late_is_not_given_up(self):
        made = self.make(GOOD)
        release = threading.Event()
        self.library.analyse = lambda tap, context: release.wait(10.) and GOOD
        with mock.patch.object(made._analyser, '_limit', .05):
            self.fails()
        release.set()
        made._analyser._thread.join()
        self.assertEqual(self.run_tap()[0][2], .05)
        self.assertTrue(made.get_status(0.)['active'])

    def test_a_motion_that_is_made_otherwise_leaves_probing_to_klipper(self):
        self.make(GOOD)
        del self.printer.objects['motion_report'].dtrapqs['toolhead']
        self.printer.handlers['klippy:ready']()
        self.assertEqual(self.run_tap(), (self.own, True))
        self.assertIn("extract_trapq", self.printer.said[-1])


class OwnFitTest(TappingTest):
    """All of the above in a Klipper that fits the contact by itself."""

    def setUp(self):
        super().setUp()
        self.probe = self.printer.objects['load_cell_probe'] = fake_klipper.OwnFitProbe(
            self.toolhead)
        self.own = "Klipper's own fit"

    def test_it_is_said_whose_height_it_is(self):
        self.make(GOOD)
        self.printer.handlers['klippy:ready']()
        self.assertIn("takes the place of that fit", self.printer.said[0])
        self.assertGreaterEqual(fake_klipper.Reactor.delays[-1], 4.)  # Moonraker hears it

    def test_the_nozzle_is_pulled_back_once_and_lifted_as_far_as_klippers_own_tap_does(self):
        self.make(GOOD)
        self.assertEqual(self.run_tap(), ([100., 100., .05, 0.], True))
        (pull_back, slow), (lift, fast) = self.toolhead.moves
        self.assertAlmostEqual(pull_back[2], .01 + .2)
        self.assertAlmostEqual(slow, .32)
        self.assertEqual((lift, fast), ([None, None, .01 + 2.], 5.))

    def test_the_nozzle_is_pulled_back_before_the_tap_is_analysed(self):
        self.make(GOOD)
        self.library.analyse = lambda tap, context: GOOD._replace(z=self.toolhead.position[2])
        self.assertAlmostEqual(self.run_tap()[0][2], .21)

    def test_a_lift_that_is_not_named_leaves_probing_to_klipper(self):
        self.probe.get_probe_params = lambda gcmd: {'sample_retract_dist': 0., 'lift_speed': 5.}
        with self.assertRaisesRegex(TapError, "how far a probe lifts"):
            LoadCellProbe(self.probe)

    def test_the_first_touch_of_g28_is_klippers_and_the_second_is_not_scrubbed(self):
        self.make(GOOD)
        self.toolhead.top = .1  # the height that G28 has made up is above all that is in range
        first = fake_klipper.GCodeCommand('G28', HOME_ATTEMPT_NUM='1')
        self.assertEqual(self.run_tap(first), ([100., 100., .02, 0.], True))
        self.assertEqual(self.toolhead.moves, [])
        self.probe.sensor_errors = [(3, 1)]
        with self.assertRaisesRegex(fake_klipper.CommandError, "3 errors and 1 overflows"):
            self.run_tap(first)

    def test_klippers_batch_mode_has_no_samples_and_taps_by_itself(self):
        self.make(GOOD)
        self.printer.start_args = {'debugoutput': 'out'}
        self.assertEqual(self.run_tap(), ("Klipper's own fit", True))


class AnalyserTest(unittest.TestCase):
    def test_an_analysis_that_hangs_is_given_up_and_no_other_begun(self):
        release = threading.Event()
        library = types.SimpleNamespace(analyse=lambda tap, context: release.wait(10.) and GOOD)
        analyse = analyser.Analyser(fake_klipper.Reactor, library, limit=.05).analyse
        with self.assertRaisesRegex(TapError, "took longer"):
            analyse(None, None)
        with self.assertRaisesRegex(TapError, "restart Klipper's service"):
            analyse(None, None)
        release.set()


class LoadConfigTest(unittest.TestCase):
    def setUp(self):
        self.printer = fake_klipper.Printer()
        self.sections = {'trammel_tap': {'library': '/nowhere/libtrammel_tap.so'},
                         'load_cell_probe': {}, 'stepper_z': {}}

    def load(self):
        return trammel_tap.load_config(fake_klipper.Config(self.printer, self.sections))

    def refuses(self, text):
        with self.assertRaisesRegex(ValueError, text):
            self.load()

    def test_without_the_library_it_says_so_and_probing_stays_klippers(self):
        made = self.load()
        self.assertEqual(self.printer.objects['load_cell_probe']._tapping_move.run_tap(None),
                         ("Klipper's own", True))
        self.printer.handlers['klippy:ready']()
        self.assertIn('/nowhere/libtrammel_tap.so', self.printer.said[0])
        self.assertTrue(self.printer.said[1].startswith('!! '))
        status = made.get_status(0.)
        self.assertFalse(status['active'])
        self.assertIn('/nowhere/libtrammel_tap.so', status['trouble'])

    def test_a_g28_that_ends_with_its_first_touch_is_refused(self):
        self.sections['stepper_z'] = {'endstop_pin': 'probe:z_virtual_endstop',
                                      'homing_retract_dist': 0.}
        with mock.patch('trammel_tap.open_library'):
            self.refuses("'homing_retract_dist' in section 'stepper_z' must be above 0")
            self.sections['stepper_z']['endstop_pin'] = 'PA1'
            self.load()

    def test_a_sensor_that_is_too_slow_is_refused_by_its_option(self):
        sensor = self.printer.objects['load_cell_probe']._load_cell.sensor
        with mock.patch('trammel_tap.open_library'):
            for rate in (10, 20):
                sensor.get_samples_per_second = lambda: rate
                self.refuses("'sample_rate' in section 'load_cell_probe' must be at least 40; it is %d"
                             % rate)
            sensor.get_samples_per_second = lambda: 45
            self.load()

    def test_a_printer_without_a_load_cell_is_refused(self):
        del self.sections['load_cell_probe']
        self.refuses('load_cell_probe')

    def leaves_probing_to_klipper(self, name):
        tapping_move = self.printer.objects['load_cell_probe']._tapping_move
        with mock.patch('trammel_tap.open_library'):
            made = self.load()
        self.printer.handlers['klippy:ready']()
        self.assertIn(name, self.printer.said[0])
        self.assertTrue(self.printer.said[1].startswith('!! '))
        self.assertFalse(made.get_status(0.)['active'])
        self.assertEqual(tapping_move.run_tap(None), ("Klipper's own", True))

    def test_where_klippers_names_changed_it_says_so_and_probing_stays_klippers(self):
        for name in [n[0] for n in PROBE_NAMES if n[0] != '_tapping_move.run_tap']:
            with self.subTest(name=name):
                self.setUp()
                of = self.printer.objects['load_cell_probe']
                *way, last = name.split('.')
                for step in way:
                    of = getattr(of, step)
                if last == 'get_probe_params':
                    of.get_probe_params = None
                else:
                    delattr(of, last)
                self.leaves_probing_to_klipper(last)

    def test_where_klipper_calls_otherwise_it_says_so_and_probing_stays_klippers(self):
        tapping_move = self.printer.objects['load_cell_probe']._tapping_move
        tapping_move._load_cell_probing_move.probing_move = lambda gcmd, speed: None
        self.leaves_probing_to_klipper('probing_move with other arguments')

    def test_a_library_that_hangs_when_it_is_loaded_does_not_keep_klipper(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'libtrammel_tap.so.1')
            os.mkfifo(path)  # nobody writes: dlopen waits in it, and keeps all threads
            with self.assertRaisesRegex(TapError, "did not answer within"):
                open_library(path, 2.)

    def test_a_library_for_another_processor_does_not_end_klipper(self):
        with tempfile.TemporaryDirectory() as folder:
            ends = os.path.join(folder, 'python')
            with open(ends, 'w', encoding='utf-8') as script:
                script.write('#!/bin/sh\nkill -ILL $$\n')
            os.chmod(ends, 0o700)
            with mock.patch('sys.executable', ends):
                with self.assertRaisesRegex(TapError, "by signal 4: install the one for this"):
                    open_library('/some/where.so')

    def test_a_library_that_was_tried_is_loaded(self):
        with mock.patch('trammel_tap.library.Library') as made:
            self.assertIs(open_library('/some/where.so'), made.return_value)

    def test_a_section_in_kalico_is_refused_with_what_to_write_instead(self):
        with mock.patch.dict(sys.modules, klippy=types.SimpleNamespace(APP_NAME='Kalico')):
            self.refuses('tap_classifier: trammel')

    def test_options_out_of_range_are_refused(self):
        for option, value in (('pullback_distance', .04), ('pullback_distance', 1.1),
                              ('pullback_speed', .01), ('pullback_speed', 2.1), ('retries', -1),
                              ('retries', 11), ('latency', -.21), ('latency', .21)):
            with self.subTest(option=option, value=value):
                self.sections['trammel_tap'] = {option: value}
                self.refuses(option)

    def test_a_pull_back_that_takes_too_long_is_refused(self):
        for options in ({'pullback_distance': 1., 'pullback_speed': .05},
                        {'pullback_distance': math.nan}, {'pullback_speed': math.nan}):
            self.sections['trammel_tap'] = options
            self.refuses("takes longer than 10 s")

    def test_an_uncertainty_of_a_latency_that_is_not_stated_is_refused(self):
        self.sections['trammel_tap'] = {'latency_uncertainty': .001}
        self.refuses("needs 'latency'")


class KalicoTap:
    """As much of Kalico's tap_analysis as a classifier sees; bad by Kalico's own judgement."""

    def __init__(self):
        self.valid, self.error, self._tap_pos = False, 'TAP_SHAPE_INVALID', None

    get_time = staticmethod(lambda: [0., .1])
    get_force = staticmethod(lambda: [5., 6.])
    get_trigger_force = staticmethod(lambda: 75.)

    @staticmethod
    def get_moves():
        return [types.SimpleNamespace(print_time=0., move_t=1., start_v=.3, accel=0., start_x=10.,
                                      start_y=20., start_z=.01, z_r=1.)]

    def set_is_valid(self, valid):
        self.valid = valid

    def set_validation_error(self, error):
        self.error = error


class TapValidationError(Exception):
    pass


class KalicoTest(unittest.TestCase):
    def setUp(self):
        module = types.SimpleNamespace(TapValidationError=TapValidationError)
        modules = {'klippy': types.SimpleNamespace(APP_NAME='Kalico'),
                   'klippy.extras': types.SimpleNamespace(),
                   'klippy.extras.load_cell': types.SimpleNamespace(),
                   'klippy.extras.load_cell.tap_analysis': module}
        patch = mock.patch.dict(sys.modules, modules)
        patch.start()
        self.addCleanup(patch.stop)
        self.tap = KalicoTap()

    def classify(self, answer):
        """Through what register_components leaves in Kalico."""
        registered = {}
        trammel_tap.register_components(types.SimpleNamespace(
            register_component=lambda kind, name, made: registered.update({(kind, name): made})))
        factory = registered['load_cell_probe_tap_classifiers', 'trammel']
        self.library = Library(answer)
        config = fake_klipper.Config(fake_klipper.Printer(), {'load_cell_probe': {}},
                                     'load_cell_probe')
        gcmd = fake_klipper.GCodeCommand()
        with mock.patch('trammel_tap.kalico.open_library', lambda path: self.library):
            classifier = factory(config)
        try:
            classifier.classify(self.tap, gcmd)
        finally:
            self.said = gcmd.said

    def test_a_good_tap_has_trammels_place_whatever_kalico_thought_of_it(self):
        self.classify(GOOD)
        self.assertEqual(self.tap._tap_pos, (10., 20., .05))
        self.assertEqual((self.tap.valid, self.tap.error), (True, None))
        self.assertEqual(self.library.taps[0][1].trigger_force, 75.)

    def test_a_refused_tap_is_bad_with_its_reason_said(self):
        with self.assertRaises(TapValidationError) as caught:
            self.classify(refused('adhesion'))
        self.assertEqual(caught.exception.args, ('ADHESION', "Sentence."))
        self.assertIn("refused, adhesion: Sentence.", self.said[0])

    def test_a_library_that_hangs_leaves_the_tap_to_kalico(self):
        with mock.patch('trammel_tap.analyser.Analyser.hangs', lambda self: True):
            self.classify(GOOD)
        self.assertEqual((self.tap._tap_pos, self.tap.error), (None, 'TAP_SHAPE_INVALID'))

    def test_a_bug_makes_a_bad_tap_and_no_shutdown(self):
        with mock.patch('logging.exception'), self.assertRaises(TapValidationError):
            self.classify(KeyError("of the analysis"))

    def test_without_the_library_the_configuration_is_refused(self):
        config = fake_klipper.Config(
            fake_klipper.Printer(), {'load_cell_probe': {'trammel_library': '/nowhere.so'}},
            'load_cell_probe')
        with self.assertRaisesRegex(ValueError, 'tap_classifier: trammel: .*/nowhere.so'):
            trammel_tap.Classifier(config)


if __name__ == '__main__':
    unittest.main()
