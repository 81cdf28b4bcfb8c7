from calibration_pattern import calibration_pattern

p = calibration_pattern()  # any name
p.pitch = 1
p.gen.rotation = 20
p.gen.insert_pause = False
tools = [1, 2, 3]
lines = p.full_interlocked_print(tools, 2, "a, (b).gcode")
p.gen.x_offsets = [0, -0.05, 0.05]
p.full_interlocked_print([2, 2, 2], 2, 'c.gcode')
lines = p.meander_print(1, 'd.gcode')
