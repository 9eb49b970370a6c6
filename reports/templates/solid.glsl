#version 300 es
// The tooth's surface where a ray first meets a density of one half; colours as in voxels.js.
precision highp float;
precision highp sampler3D;
precision highp usampler3D;

uniform sampler3D density;   // 0 to 1, now
uniform usampler3D tissues;
uniform usampler3D verdicts;
uniform sampler3D coarse;    // the most density at the start in bricks of BRICK voxels and one around
uniform sampler2D palette;   // row 0 tissue, 1 verdict, 2 standing by tissue, kept; 3 standing by tissue, sound
uniform vec3 dims;           // voxels
uniform vec3 spacing;        // mm
uniform vec3 low;            // corners of what is not cut away, voxels
uniform vec3 high;
uniform vec3 middle;         // of the picture, voxels
uniform vec3 right;          // from the middle to the edge, voxels
uniform vec3 up;
uniform vec3 away;           // from the eye: one mm, voxels
uniform bool byVerdict;
uniform bool byDeviation;
uniform sampler3D deviations; // distances from the ideal cavity, -deviationMost to deviationMost mm as 0 to 1
uniform vec3 deviationLow;    // the part that they cover, voxels
uniform vec3 deviationSize;
uniform float deviationMost;
uniform vec3 shallow;         // colours of the scale
uniform vec3 planned;
uniform vec3 deep;
uniform bool patterns;
uniform bool hasRing;
uniform vec3 ring;           // a place that is marked by a ring, voxels
in vec2 place;               // -1 to 1
out vec4 colour;

const float BRICK = 8.0;
const float STEP = 0.7;
const float RING = 0.35;        // radius of the ring, mm
const float REACH = 200.0;      // depth of the picture before and behind its middle, mm
const float RING_DEPTH = 0.4;   // how far before the place something may lie and not hide it, mm
const uint OUTSIDE = 0u, RIGHTLY = 2u, LEEWAY = 3u, OVERCUT = 4u, LEFT = 5u, VULNERABLE = 6u, KEPT = 7u;

float at(vec3 p) { return texture(density, (p + 0.5) / dims).r; }

vec3 outward(vec3 p) {
  const float e = 1.0;
  vec3 slope = vec3(at(p + vec3(e, 0, 0)) - at(p - vec3(e, 0, 0)), at(p + vec3(0, e, 0)) - at(p - vec3(0, e, 0)),
                    at(p + vec3(0, 0, e)) - at(p - vec3(0, 0, e))) / spacing;
  float size = length(slope);
  return size > 0.0 ? -slope / size : -normalize(away * spacing);
}

uvec2 meant(ivec3 cell) {
  ivec3 held = clamp(cell, ivec3(0), ivec3(dims) - 1);
  return uvec2(texelFetch(tissues, held, 0).r, texelFetch(verdicts, held, 0).r);
}
float now(ivec3 cell) { return texelFetch(density, clamp(cell, ivec3(0), ivec3(dims) - 1), 0).r; }
vec3 tissue(uint label) { return texelFetch(palette, ivec2(label, 0), 0).rgb; }
vec3 verdict(uint number) { return texelFetch(palette, ivec2(number, 1), 0).rgb; }

vec3 standing(uint label, uint number) {
  bool toGo = number == LEFT || ((number == RIGHTLY || number == OUTSIDE) && texelFetch(palette, ivec2(label, 0), 0).a < 0.5);
  if (toGo) return verdict(LEFT);
  return texelFetch(palette, ivec2(label, number == KEPT ? 2 : 3), 0).rgb;
}

bool isGone(ivec3 cell) {
  uint number = meant(cell).g;
  return now(cell) < 0.5 && (number == RIGHTLY || number == LEEWAY || number == OVERCUT || number == VULNERABLE);
}

// As deviationColour in deviation.js.
vec3 deviated(vec3 p) {
  float share = 2.0 * texture(deviations, (p - deviationLow + 0.5) / deviationSize).r - 1.0;
  return mix(planned, share < 0.0 ? shallow : deep, sqrt(abs(share)));
}

// What a place on the surface shows: the verdict on what was taken away from it, else what stands there.
vec3 shown(vec3 p, vec3 n) {
  vec3 inward = p - 0.6 * n / spacing * min(spacing.x, min(spacing.y, spacing.z));
  uvec2 here = meant(ivec3(round(inward)));
  if (!byVerdict && !byDeviation) return tissue(here.r);
  vec3 kept = byDeviation ? 0.45 + 0.55 * tissue(here.r) : standing(here.r, here.g);
  bool isLeft = byDeviation ? here.g == LEFT : kept == verdict(LEFT);
  if (byDeviation && isLeft) return deviated(p);
  vec3 beside = p + 1.2 * n / spacing * min(spacing.x, min(spacing.y, spacing.z));
  ivec3 base = ivec3(floor(beside));
  vec3 share = beside - vec3(base), sum = vec3(0.0);
  float weight = 0.0, wrong = 0.0;
  for (int i = 0; i < 8; i++) {
    ivec3 corner = ivec3(i & 1, (i >> 1) & 1, i >> 2);
    if (!isGone(base + corner)) continue;
    vec3 w = mix(1.0 - share, share, vec3(corner));
    uint number = meant(base + corner).g;
    float part = w.x * w.y * w.z;
    sum += part * (byDeviation ? deviated(p) : verdict(number));
    weight += part;
    if (number == OVERCUT || number == VULNERABLE) wrong += part;
  }
  vec3 found = kept;
  if (weight > 0.0 && !isLeft) found = mix(kept, sum / weight, smoothstep(0.1, 0.5, weight));
  if (byDeviation) return found;
  bool isWrong = isLeft ? here.g == LEFT : wrong > 0.5 * max(weight, 0.2);
  float stripe = mod(dot(p * spacing, vec3(1.0)), 0.5);
  if (patterns && isWrong && stripe < 0.16) found = isLeft ? mix(found, vec3(1.0), 0.35) : found * 0.62;
  return found;
}

// The ring around a place, as it is seen from the eye; hidden where something lies before the place. `t` is the distance of
// what the ray meets, mm. Black within white: seen on every ground, and over the instrument. Sets the depth of the picture.
vec4 marked(vec4 seen, vec3 origin, float t) {
  gl_FragDepth = clamp(0.5 + 0.5 * t / REACH, 0.0, 1.0);
  vec3 to = (ring - origin) * spacing, forward = away * spacing;
  float along = dot(to, forward), off = abs(length(to - along * forward) - RING);
  if (!hasRing || t < along - RING_DEPTH || off > 0.1) return seen;
  gl_FragDepth = 0.0;
  return off < 0.06 ? vec4(0.0, 0.0, 0.0, 1.0) : vec4(1.0);
}

void main() {
  vec3 origin = middle + place.x * right + place.y * up;
  vec3 inverse = 1.0 / (away + vec3(equal(away, vec3(0.0))) * 1e-9);
  vec3 a = (low - origin) * inverse, b = (high - origin) * inverse;
  vec3 nearer = min(a, b), farther = max(a, b);
  float t = max(nearer.x, max(nearer.y, nearer.z)), end = min(farther.x, min(farther.y, farther.z));
  const float FAR = 1e6;
  colour = marked(vec4(0.0), origin, FAR);
  if (t >= end) return;
  float pace = STEP / length(away);
  vec3 p = origin + (t + 1e-4) * away;
  if (at(p) > 0.5) {
    // A section: cut open by the clip planes, lit from nowhere.
    uvec2 here = meant(ivec3(round(p)));
    vec3 c = byVerdict && !byDeviation ? standing(here.r, here.g) : tissue(here.r);
    colour = marked(vec4(c * 0.94, 1.0), origin, t);
    return;
  }
  vec3 bricks = ceil(dims / BRICK);
  float before = 0.0;
  for (int i = 0; i < 4000 && t < end; i++) {
    p = origin + t * away;
    vec3 brick = floor((p + 0.5) / BRICK);
    if (texelFetch(coarse, clamp(ivec3(brick), ivec3(0), ivec3(bricks) - 1), 0).r < 0.5) {
      // Nothing was ever here: on to the next brick.
      vec3 edge = (brick + step(vec3(0.0), away)) * BRICK - 0.5;
      vec3 exits = (edge - origin) * inverse;
      t = max(min(exits.x, min(exits.y, exits.z)), t) + 0.02 * pace;
      before = 0.0;
      continue;
    }
    float here = at(p);
    if (here > 0.5) {
      t -= pace * (here - 0.5) / max(here - before, 1e-3);
      p = origin + t * away;
      vec3 n = outward(p), back = -normalize(away * spacing);
      // One light beside the eye; and less of it in hollows.
      vec3 lamp = normalize(back + 0.45 * normalize(up * spacing) - 0.35 * normalize(right * spacing));
      float light = 0.34 + 0.66 * max(dot(n, lamp), 0.0);
      vec3 out1 = n / spacing * 0.35, out2 = n / spacing * 0.9;
      light *= 1.0 - 0.22 * at(p + out1) - 0.22 * at(p + out2);
      vec3 c = shown(p, n) * light + 0.08 * pow(max(dot(n, normalize(lamp + back)), 0.0), 40.0);
      colour = marked(vec4(c, 1.0), origin, t);
      return;
    }
    before = here;
    t += pace;
  }
}
