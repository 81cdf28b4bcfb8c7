// The further worlds of the tap study: each input swept over what a user could have and past it.
#pragma once

#include <string>
#include <vector>

#include "tap_study_row.h"

namespace trammel {

/// One thing at a time: noise, pull-back, rate, converter, time stamps, press, structure, plastic.
[[nodiscard]] std::vector<TapRow> FurtherRows();

/// Quiet noise, slow and long pull-backs together, and other pairs that meet in practice.
[[nodiscard]] std::vector<TapRow> CrossedRows();

/// Any cell, motion and at most two disturbances: a printer that somebody has.
void DrawOrdinaryTap(TapRow& row, Random& random);

/// Any cell, motion and each disturbance with one chance in three.
void DrawAnyTap(TapRow& row, Random& random);

/// What a drawn tap is like, in a line.
[[nodiscard]] std::string Describe(const TapRow& row);

}  // namespace trammel
