// A LIDAR's beams in a picture for people.
#pragma once

#include "racecraft/camera.hpp"
#include "racecraft/ground.hpp"
#include "scene.hpp"

namespace racecraft {

// What is hit shows its side to the scanner. Where the lens sees that side, too, the beam's end lies on it
// and is drawn over it; all the rest lies behind, and is drawn first.
enum class ScanPart { beams, facing_ends };

// Draws a part of a scan, thin lights and dots where they end, into `out` (height, width, 3).
void draw_scan(const CameraSpec& spec, const LensPose& lens, const GroundView& ground,
               const ScanPicture& scan, ScanPart part, uint8_t* out);

}  // namespace racecraft
