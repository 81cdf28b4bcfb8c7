"""The parts of Klipper that the extra touches, as small as they can be."""
import threading
import time
import types


class CommandError(Exception):
    pass


class Completion:
    def __init__(self):
        self._done = threading.Event()
        self._result = None

    def complete(self, result):
        self._result = result
        self._done.set()

    def wait(self, waketime, waketime_result=None):
        done = self._done.wait(max(0., waketime - time.monotonic()))
        return self._result if done else waketime_result


class Reactor:
    monotonic = staticmethod(time.monotonic)
    completion = Completion

    delays = []  # of what was registered, which runs at once

    @classmethod
    def register_callback(cls, callback, waketime):
        cls.delays.append(waketime - time.monotonic())
        callback(waketime)

    @staticmethod
    def async_complete(completion, result):
        completion.complete(result)


class Toolhead:
    """Moves at once and takes a second for it; knows the highest z."""

    def __init__(self, top=250.):
        self.position = [100., 100., 2., 0.]
        self.time = 1000.
        self.top = top
        self.moves = []

    def get_position(self):
        return list(self.position)

    def manual_move(self, coord, speed):
        if coord[2] is not None and coord[2] > self.top:
            raise CommandError("Move out of range")
        for axis, value in enumerate(coord):
            if value is not None:
                self.position[axis] = value
        self.moves.append((list(coord), speed))
        self.time += 1.

    def get_last_move_time(self):
        return self.time

    def get_extruder(self):
        return types.SimpleNamespace()


class Collector:
    """Holds a sample every 10 ms of the 5 s before it is asked."""

    def __init__(self, errors=0):
        self.errors = errors
        self.stopped = False

    def collect_until(self, end):
        return [(end - 5. + .01 * i, 1., 100, 0) for i in range(501)], self.errors

    def stop_collecting(self):
        self.stopped = True

    def on_samples(self, message):
        return True


class LoadCellProbe:
    """Presses to z = 0.01, where it triggers at z = 0.02; or fails as told."""

    def __init__(self, toolhead):
        self.toolhead = toolhead
        self.failure = None
        self.collectors = []
        self.sensor_errors = []
        self.client_cbs = []
        self.sent = []
        probing_move = types.SimpleNamespace(probing_move=self._press)
        self._tapping_move = types.SimpleNamespace(
            run_tap=lambda gcmd: ("Klipper's own", True), _load_cell_probing_move=probing_move,
            _config_helper=types.SimpleNamespace(get_trigger_force_grams=lambda gcmd: 75.),
            _clients=types.SimpleNamespace(send=self.sent.append, client_cbs=[]),
            _last_result=None, _is_last_result_valid=False)
        self._load_cell = types.SimpleNamespace(
            clients=types.SimpleNamespace(client_cbs=self.client_cbs), get_collector=Collector,
            sensor=types.SimpleNamespace(get_samples_per_second=lambda: 320))

    def get_probe_params(self, gcmd):
        return {'sample_retract_dist': 2., 'lift_speed': 5.}

    def _press(self, gcmd):
        collector = Collector(self.sensor_errors.pop(0) if self.sensor_errors else 0)
        self.collectors.append(collector)
        self.client_cbs.append(collector.on_samples)
        self.toolhead.position[2] = .01
        if self.failure is not None:
            self.toolhead.position[2] = -2.
            raise self.failure
        return [100., 100., .02, 0.], collector


class OwnFitProbe(LoadCellProbe):
    """As Klipper since August 2026: its tap lifts the nozzle by itself, and its callers do not."""

    def __init__(self, toolhead):
        super().__init__(toolhead)
        self._tapping_move.run_tap = self._fit
        self._tapping_move._best_fit = object()
        self._tapping_move._analyze_ascent = lambda *arguments: .05

    def get_probe_params(self, gcmd):
        return {'sample_retract_dist': 0., 'load_cell_retract_dist': 2., 'lift_speed': 5.}

    def _fit(self, gcmd):
        place, collector = self._press(gcmd)
        self.toolhead.manual_move([None, None, self.toolhead.position[2] + 2.], 5.)
        return "Klipper's own fit", True


class GCodeCommand:
    error = CommandError

    def __init__(self, command='PROBE', **params):
        self.command, self.params, self.said = command, params, []

    def get_command(self):
        return self.command

    def get(self, name, default):
        return self.params.get(name, default)

    def get_float(self, name, default, minval=None, maxval=None):
        value = self.params.get(name, default)
        if value < minval or value > maxval:  # as Klipper: nan passes
            raise CommandError("%s out of range" % name)
        return value

    get_int = get_float

    def respond_info(self, text):
        self.said.append(text)


class Trapq:
    """A descent, a rest and a rise before the present moment."""

    def __init__(self, toolhead):
        self.toolhead = toolhead

    def extract_trapq(self, start, end):
        names = ('print_time', 'move_t', 'start_v', 'accel', 'start_x', 'start_y', 'start_z',
                 'x_r', 'y_r', 'z_r')
        values = ((end - 3., 1., 2., 0., 100., 100., 2., 0., 0., -1.),
                  (end - 1., 1., .2, 0., 100., 100., .01, 0., 0., 1.))
        return [types.SimpleNamespace(**dict(zip(names, v))) for v in values], None


class Printer:
    command_error = CommandError

    def __init__(self):
        self.toolhead = Toolhead()
        self.shutdown = False
        self.start_args = {}
        self.handlers = {}
        self.said = []
        self.objects = {
            'toolhead': self.toolhead, 'load_cell_probe': LoadCellProbe(self.toolhead),
            'motion_report': types.SimpleNamespace(dtrapqs={'toolhead': Trapq(self.toolhead)}),
            'configfile': types.SimpleNamespace(runtime_warning=self.said.append),
            'gcode': types.SimpleNamespace(respond_raw=self.said.append),
            'gcode_macro': types.SimpleNamespace(load_template=lambda config, name: name)}

    def lookup_object(self, name):
        return self.objects[name]

    def load_object(self, config, name):
        return self.objects[name]

    def get_reactor(self):
        return Reactor

    def get_start_args(self):
        return self.start_args

    def is_shutdown(self):
        return self.shutdown

    def register_event_handler(self, event, handler):
        self.handlers[event] = handler


class Config:
    """A section of a configuration, given as {section: {option: value}}."""
    error = ValueError

    def __init__(self, printer, sections, name='trammel_tap'):
        self._printer, self._sections, self._options = printer, sections, sections[name]

    def get_printer(self):
        return self._printer

    def has_section(self, name):
        return name in self._sections

    def getsection(self, name):
        return Config(self._printer, self._sections, name)

    def get(self, option, default, note_valid=True):
        return self._options.get(option, default)

    def getfloat(self, option, default, minval=None, maxval=None, note_valid=True):
        value = self._options.get(option, default)
        if value is not None and ((minval is not None and value < minval)
                                  or (maxval is not None and value > maxval)):
            raise ValueError("%s out of range" % option)
        return value

    getint = getfloat
