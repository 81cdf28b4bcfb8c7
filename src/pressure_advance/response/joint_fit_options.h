// What the joint fit of both transitions assumes.
#pragma once

namespace trammel::pressure_advance {

struct JointFitOptions {
  /// Bend of the acceleration's response, 1 sigma about 0; as ResponseOptions::acceleration.
  double acceleration_bend_sigma = 0.02;
  /// Bend of the deceleration's: gaps flatten it.
  double deceleration_bend_mean = -0.1;
  double deceleration_bend_sigma = 0.15;
  /// What the two straight halves leave out, as a part of the distance from the answer.
  double acceleration_distance_sigma = 0.1;
  double deceleration_distance_sigma = 0.15;
  /// By how much the slope of the deceleration may differ from that of the acceleration.
  double slope_sigma = 0.3;
  /// Flow lost at the fast speed, as a part of it: above 0 Student's t with two degrees of freedom,
  /// so that much slip is believed where the lines show it; below 0, where only an error of the
  /// level leads, normal.
  double slip_scale = 0.02;
  double level_scale = 0.012;
  double tail_sigma = 0.05;        ///< as ResponseOptions::tail_sigma
  double tail_share = 0.4;         ///< as ResponseOptions::tail_share
  double tail_share_sigma = 0.12;  ///< likewise
  /// What the form of the lag leaves open beyond that, as a part of the answer: without noise, laws
  /// from linear to strongly shear-thinning moved it by up to 1.3 %, 0.6 % on the average.
  double form_sigma = 0.005;
  /// Readings along a line scatter together (texture, speckle, wandering flow): their sum by this
  /// many times what each by itself tells.
  double acceleration_reading_factor = 2;
  double deceleration_reading_factor = 1.5;
  double lag_scatter_s = 0.0015;  ///< from line to line, before the lines are seen …
  double lag_scatter_lines = 3;   ///< … worth this many lines
  double outlier_scale = 6;       ///< Tukey's biweight: a line this many sigma away counts nothing
};

}  // namespace trammel::pressure_advance
