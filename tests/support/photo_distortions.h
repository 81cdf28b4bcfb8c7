// Distortions of a photo by phones, lenses, lamps and messengers.
#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace trammel::test {

struct Distortion {
  std::string name;
  std::function<cv::Mat(const cv::Mat&)> apply;
  bool mirrored = false;  ///< the picture shows the pattern from behind
};

/// Those that a photo has to bear: turned in place and on a grown canvas, mirrored, cropped by 8 %,
/// perspective up to 20 %, a shadow, blur up to 2 px, noise, JPEG, grey, half of the size. The
/// first leaves it as it is.
[[nodiscard]] std::vector<Distortion> CommonDistortions();

/// Lists other objects and light in the picture: a hand, a second pattern, a bright spot, dusk, a
/// colour cast, a shaken camera, a bent lens. An answer has to be right, a refusal is allowed.
[[nodiscard]] std::vector<Distortion> Surroundings();

/// Past both ends of what can be read: most of these have to be refused.
[[nodiscard]] std::vector<Distortion> DistortionsBeyondUse();

/// The picture turned about its middle, its border carried on; on a canvas of the same size, or on
/// one that holds all of it.
[[nodiscard]] cv::Mat Turned(const cv::Mat& picture, double degrees, bool grown);

}  // namespace trammel::test
