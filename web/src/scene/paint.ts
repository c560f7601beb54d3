/** The one material of the 3D view. Light, haze and the screen's colours are worked out at the corners of the triangles, so
 * that a pixel costs nothing: faces are flat, and many screens are drawn without a GPU. */
import * as three from "three";

const VERTEX = `
uniform vec3 haze;
uniform vec2 hazeRange;
varying vec3 shade;

const vec3 SUN = vec3(0.291, -0.389, 0.874);

vec3 toScreen(vec3 linear) {
  return mix(12.92 * linear, 1.055 * pow(linear, vec3(0.41667)) - 0.055, step(0.0031308, linear));
}

void main() {
  vec4 place = vec4(position, 1.0);
  vec3 up = normal;
  vec3 tint = color;
#ifdef USE_INSTANCING
  place = instanceMatrix * place;
  up = mat3(instanceMatrix) * up;
#endif
#ifdef USE_INSTANCING_COLOR
  tint *= mix(vec3(1.0), instanceColor, step(0.5, tint.r)); // the dark parts are as they are
#endif
  vec4 seen = modelViewMatrix * place;
  vec3 light = mix(vec3(0.26, 0.28, 0.27), vec3(0.56), 0.5 + 0.5 * up.z) + vec3(0.52, 0.49, 0.45) * max(dot(up, SUN), 0.0);
  shade = mix(toScreen(min(tint * light, 1.0)), haze, smoothstep(hazeRange.x, hazeRange.y, length(seen.xyz)));
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = `
varying vec3 shade;
void main() {
  gl_FragColor = vec4(shade, 1.0);
}`;

export class Paint extends three.ShaderMaterial {
  constructor() {
    const uniforms = { haze: { value: new three.Vector3() }, hazeRange: { value: new three.Vector2(1e6, 2e6) } };
    super({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, vertexColors: true });
  }

  /** What is far away fades into a colour between two distances in metres. */
  fade(color: three.Color, from: number, to: number): void {
    const { r, g, b } = color.clone().convertLinearToSRGB();
    (this.uniforms["haze"]!.value as three.Vector3).set(r, g, b);
    (this.uniforms["hazeRange"]!.value as three.Vector2).set(from, to);
  }
}

/** Triangles with a linear colour at every corner. */
export function painted(positions: number[], colors: number[]): three.BufferGeometry {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(positions, 3));
  geometry.setAttribute("color", new three.Float32BufferAttribute(colors, 3));
  return geometry;
}

/** One colour for faces that keep their own normals. */
export function paintFaces(geometry: three.BufferGeometry, color: number): three.BufferGeometry {
  const count = geometry.getAttribute("position").count;
  const tint = new three.Color(color).toArray();
  geometry.setAttribute("color", new three.Float32BufferAttribute(Array.from({ length: count }, () => tint).flat(), 3));
  geometry.deleteAttribute("uv");
  return geometry;
}

/** Flat ground has one colour and looks up. */
export function paintGround(geometry: three.BufferGeometry, color: number): three.BufferGeometry {
  const count = geometry.getAttribute("position").count;
  geometry.setAttribute(
    "normal",
    new three.Float32BufferAttribute(Array.from({ length: count }, () => [0, 0, 1]).flat(), 3),
  );
  return paintFaces(geometry, color);
}
