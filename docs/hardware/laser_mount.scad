// A mount for a line laser and a nozzle camera on a printer's head.
// Coordinates: x right, y away from the head, z up; the origin is the point on the plate where the
// laser's sheet meets the camera's axis. Print it lying on its back, without supports.

// Measure these five on your parts, mm and degrees.
camera_focus = 34.5;   // lens front to plate where the picture is sharp
camera_diameter = 14;  // barrel of the camera
laser_diameter = 12;   // tube of the laser module
laser_length = 30;     // tube, without its cable
laser_angle = 45;      // between the laser's sheet and the camera's axis: 30 to 60

laser_distance = 40;   // laser front to plate, along its beam
play = 0.3;            // gap round each tube; a set screw holds the tube
wall = 4;
set_screw = 2.7;       // M3 cuts its own thread in plastic
screw = 3.2;           // M3, through the plate into the head
plate_height = 50;
plate_holes = [30, 14]; // between the screws that hold the mount to the head, along x and z

camera_length = 20;
$fn = 64;

module tube(diameter, length) cylinder(d = diameter, h = length);

module camera_place() translate([0, 0, camera_focus]) children();

// From the plate up along the beam, which leans towards +x.
module laser_place() rotate([0, laser_angle, 0]) translate([0, 0, laser_distance]) children();

depth = max(camera_diameter, laser_diameter) / 2 + wall;  // from the axes to the plate

module clamp(diameter, length) {
  tube(diameter + 2 * wall, length);
  translate([-(diameter / 2 + wall), -depth, 0]) cube([diameter + 2 * wall, depth, length]);
}

module set_screw_hole(diameter, length) {
  translate([0, 0, length / 2]) rotate([-90, 0, 0]) cylinder(d = set_screw, h = diameter + wall);
}

module back() {
  reach = (laser_distance + laser_length) * sin(laser_angle);
  left = camera_diameter / 2 + wall;
  translate([-left, -depth - wall, camera_focus])
    cube([left + reach + laser_diameter, wall, plate_height]);
}

module holes() {
  for (x = [0, plate_holes[0]], z = [0, plate_holes[1]])
    translate([x + 2, -depth - 2 * wall, camera_focus + plate_height - 8 - z])
      rotate([-90, 0, 0]) cylinder(d = screw, h = 3 * wall);
}

difference() {
  union() {
    back();
    camera_place() clamp(camera_diameter, camera_length);
    laser_place() clamp(laser_diameter, laser_length);
  }
  camera_place() translate([0, 0, -1]) tube(camera_diameter + play, camera_length + 2);
  laser_place() translate([0, 0, -1]) tube(laser_diameter + play, laser_length + 2);
  camera_place() set_screw_hole(camera_diameter, camera_length);
  laser_place() set_screw_hole(laser_diameter, laser_length);
  holes();
}
