/** The keys of params with their types; what each says is in the catalogues, as `param_KEY`. */
export const PARAMS = {
  all_wheels_on_track: "bool",
  x: "float, m",
  y: "float, m",
  heading: "float, °",
  distance_from_center: "float, m",
  projection_distance: "float, m",
  progress: "float, %",
  steps: "float",
  speed: "float, m/s",
  steering_angle: "float, °",
  track_width: "float, m",
  track_length: "float, m",
  waypoints: "[(x, y), …], m",
  closest_waypoints: "[int, int]",
  is_left_of_center: "bool",
  is_reversed: "bool",
  closest_objects: "[int, int]",
  objects_location: "[(x, y), …], m",
  objects_left_of_center: "[bool, …]",
  object_in_camera: "bool",
  objects_speed: "[float, …], m/s",
  objects_heading: "[float, …], rad",
  objects_distance_from_center: "[float, …], m",
  objects_distance: "[float, …], m",
  is_crashed: "bool",
  is_offtrack: "bool",
  sim_time: "float, s",
} as const;

export type Param = keyof typeof PARAMS;

export const isParam = (word: string): word is Param => Object.hasOwn(PARAMS, word);

/** The key that a line's text names at a column, in quotes as params want it, and where it stands. */
export function paramAt(line: string, column: number): { name: Param; from: number; to: number } | undefined {
  for (const found of line.matchAll(/(["'])(\w+)\1/g)) {
    const from = found.index + 1;
    const name = found[2]!;
    if (column >= from && column <= from + name.length && isParam(name)) return { name, from, to: from + name.length };
  }
  return undefined;
}
