// What a fit of the lag's law takes for granted.
#pragma once

namespace trammel::pressure_advance {

struct LawOptions {
  double error_sigma = 0.3;  ///< of what the crossings err by on lines of the learnt law, 1 sigma
  /// What other laws than those learnt leave open of the crossings, over the answer, 1 sigma …
  double form_sigma = 0.01;
  double law_form_sigma = 0.015;  ///< … and of the law's own value
  double most_weight = 0.85;      ///< of the law's own value
  double shift_sigma = 0.4;       ///< of what the law moves the crossings' answer by, 1 sigma
  /// Largest LawFit::shared_misfit at which the law counts in full. The paper's twelve conditions
  /// have -0.1 to 0.1, extruder_world's laws 0.2. These were set on virtual prints of both preset
  /// patterns by extruder_world and melt_world, seeds below 1000, and widened once by the draws of
  /// 190000 and 197000, which no figure is of.
  double trusted_misfit = 0.25;
  double refuted_misfit = 0.6;   ///< from here on the crossings alone count
  double lag_form_sigma = 0.05;  ///< of what they leave open of the lag at one speed, over that lag
  double slip_form_sigma = 0.01;  ///< and of slip
  double lag_scatter = 0.04;      ///< from line to line, relative, before it is seen
  double flow_scatter = 0.015;
  double flow_noise = 0.01;
  double flow_noise_length_mm = 1.5;
  double place_scatter_mm = 0.05;  ///< of a line beside the others, 1 sigma, before it is seen
  double place_mm = 0.1;           ///< of a reading in its line, 1 sigma
  double swell = 0.1;              ///< of what a bead has more than the nominal area, 1 sigma
  double spread_mm2 = 0.04;  ///< by what filament spreads along a line, 1 sigma of its diffusion
  double droplet = 0.15;     ///< area below which a bead parts, over the nominal one
  double droplet_mm = 0.05;  ///< of nominal bead, 1 sigma, moved by that
  double seen_lines = 3;     ///< lines that what is known of the scatter beforehand counts as
};

}  // namespace trammel::pressure_advance
