"use strict";
// The path of a program in space: its lines, its deviation drawn larger than it is, and the arm where a place is chosen.

const ARM = 1, LARGE = 2; // layers: what the corner shows, and what it is too small for
const LITTLE_MORE = 1.6; // times the size of a weld
const MOST_BOLD = 5000; // lines of welds that are drawn bold
const MOST_VECTORS = 400; // vectors of the deviation that are drawn of a program
const MOST_POINTED = 4000; // places that are looked through at a movement of the mouse

class PathScene {
  constructor(host, path, packed) {
    this.path = path;
    const space = this.space = new Space(host, { label: "The path of the torch in space, with its deviation drawn larger than it is.", near: (x, y) => this.near(x, y) });
    if (!space.works) return;
    const lines = (is) => path.rows.filter((i) => path.joined(i) && is(i)), welds = lines((i) => path.welding(i)), known = lines((i) => path.space(i));
    const ends = linesTo(path.p, welds);
    space.camera.layers.enable(LARGE);
    floor(space);
    space.lines(linesTo(path.p, lines((i) => !path.welding(i))), { color: "--faint", opacity: 0.7 });
    space.lines(ends, { color: "--ink", width: welds.length < MOST_BOLD ? 3 : 1 }).layers.set(LARGE);
    space.lines(ends, { color: "--ink" }).layers.set(ARM);
    this.ribbons = { before: this.ribbon("before", 0.16, known), after: this.ribbon("after", 0.35, known) };
    [this.dot, this.tag] = [space.tag("dot"), space.tag()];
    this.coarse = path.rows.filter((i) => i % Math.ceil(path.n / MOST_POINTED) === 0);
    if (packed.arm) {
      this.arm = new Arm(space, packed.arm);
      this.arm.layer(ARM);
      this.corner = button("", () => this.show("whole arm"), { hidden: "", class: "inset", "aria-label": "show the whole arm" });
      host.append(this.corner);
      space.inset(this.corner, ARM);
    }
    this.usual = oneDigit((0.05 * diagonal(path.p) * 1000) / Math.max(largest(path.size.before.filter((_, i) => path.space(i))), 1e-4));
  }

  /** Area between the path and where the torch really goes, with its edge and vectors at even distances: a morph target as large as it is. */
  ribbon(name, opacity, rows) {
    const { path, space } = this, { n, p, s } = path, twice = (from, to) => {
      const made = new Float32Array(6 * n);
      for (let i = 0; i < n; i++)
        for (let c = 0; c < 3; c++) {
          if (from) made[6 * i + c] = from[3 * i + c];
          made[6 * i + 3 + c] = to[3 * i + c] || 0; // not known: not drawn off
        }
      return new THREE.BufferAttribute(made, 3);
    };
    const places = twice(p, p), away = twice(null, path[name].map((x) => x / 1000)), look = { transparent: true, depthTest: false };
    const part = (Kind, material, index) => {
      const geometry = new THREE.BufferGeometry().setAttribute("position", places).setIndex(new THREE.BufferAttribute(Uint32Array.from(index.flat()), 1));
      Object.assign(geometry, { morphAttributes: { position: [away] }, morphTargetsRelative: true });
      const made = new Kind(geometry, space.paint(material, `--${name}`));
      made.frustumCulled = false;
      made.layers.set(LARGE);
      space.scene.add(made);
      return made;
    };
    const step = (s[n - 1] - s[0]) / MOST_VECTORS || 1, even = rows.filter((i) => Math.floor(s[i] / step) !== Math.floor(s[i - 1] / step) || path.move[i] !== path.move[i - 1]);
    return [
      part(THREE.Mesh, new THREE.MeshBasicMaterial({ ...look, opacity, side: THREE.DoubleSide }), rows.map((i) => [2 * i - 2, 2 * i, 2 * i + 1, 2 * i - 2, 2 * i + 1, 2 * i - 1])),
      part(THREE.LineSegments, new THREE.LineBasicMaterial(look), rows.map((i) => [2 * i - 1, 2 * i + 1])),
      part(THREE.LineSegments, new THREE.LineBasicMaterial({ ...look, opacity: 0.8 }), even.map((i) => [2 * i, 2 * i + 1])),
    ];
  }

  magnify(times) {
    this.times = times;
    for (const part of Object.values(this.ribbons).flat()) part.morphTargetInfluences[0] = times;
    this.space.later();
  }

  only(name) {
    for (const [one, parts] of Object.entries(this.ribbons)) for (const part of parts) part.visible = name === "both" || name === one;
    this.space.later();
  }

  /** Show a place: the arm stands there, its deviation is written beside it. */
  choose(i) {
    const { space, path } = this;
    if (!space.works || i < 0) return;
    this.arm?.pose(path.q, i, path.move[i], path.base && path.base.subarray(12 * i, 12 * i + 12));
    if (space.small && this.around) space.small.places = [...this.arm.places(), ...this.around];
    const at = [...path.p.subarray(3 * i, 3 * i + 3)];
    this.dot(at);
    this.tag(at, `${path.targets[path.statement(i)] || ""} ${path.mm(path.size.before[i])}`);
  }

  /** Frame a weld with the torch, the path, or the arm; rows: of the weld. */
  show(what, rows = this.rows) {
    this.rows = rows;
    if (!this.space.works) return;
    const { path, arm, space } = this, few = Math.ceil(rows.length / 1000), whole = what === "whole arm";
    this.around = path.points(rows.filter((_, k) => k % few === 0 || k === rows.length - 1));
    this.plane?.removeFromParent();
    this.plane = workPlane(space, path, rows, arm);
    space.camera.layers[whole ? "enable" : "disable"](ARM);
    if (this.corner) this.corner.hidden = whole;
    const tips = (some) => some.flatMap((i) => [0, 1, 2].map((c) => path.p[3 * i + c] + (this.times / 1000) * (path.before[3 * i + c] || 0)));
    const bones = arm ? arm.places() : [], weld = [...this.around, ...bones.slice(-6)], every = [...path.p, ...tips(path.rows), ...bones.slice(-6)];
    if (space.small) space.small.places = [...bones, ...this.around];
    // A path that is hardly longer than its weld is shown whole.
    space.frame(whole ? [...bones, ...this.around] : what === "whole path" || diagonal(path.p) < LITTLE_MORE * diagonal(weld) ? every : [...weld, ...tips(rows)], this.direction());
  }

  /** Direction towards the eye from which the arm hides least of the weld, and most of its length and deviation is seen. */
  direction() {
    const { path, rows, arm } = this, vector = (values, i) => new THREE.Vector3().fromArray(values, 3 * i), ray = new THREE.Raycaster();
    const sample = rows.filter((_, k) => k % Math.ceil(rows.length / 12) === 0).map((i) => vector(path.p, i));
    const along = vector(path.p, rows.at(-1)).sub(vector(path.p, rows[0])).normalize(), away = vector(path.before, path.worst(rows)).normalize();
    ray.layers.enableAll();
    const hides = (place, eye) => { ray.set(place.clone().addScaledVector(eye, 0.05), eye); return ray.intersectObject(arm.group).length > 0; };
    const score = (eye) => {
      const hidden = arm ? sample.filter((place) => hides(place, eye)).length / sample.length : 0;
      return -8 * hidden + 1.5 * Math.sqrt(1 - along.dot(eye) ** 2) + Math.sqrt(1 - away.dot(eye) ** 2) + (arm ? 0.5 * eye.x : 0);
    };
    const eyes = [0.35, 0.6].flatMap((rise) => upTo(16).map((k) => new THREE.Vector3(Math.cos(rise), 0, Math.sin(rise)).applyAxisAngle(this.space.camera.up, (k * Math.PI) / 8)));
    return eyes.map((eye) => [score(eye), eye]).reduce((a, b) => (b[0] > a[0] ? b : a))[1].toArray();
  }

  near(x, y) {
    const { path, space } = this;
    let i = space.nearest(path.p, path.goals, x, y);
    if (i < 0) i = space.nearest(path.p, this.coarse, x, y);
    return i < 0 ? null : { text: `${path.label(i)}\n${path.deviation(i)}`, pick: () => path.chosen.set(i, "space") };
  }
}

/** The plane of a weld: through its places, at right angles to the torch as far as the weld leaves that open. */
function workPlane(space, path, rows, arm) {
  if (!arm || rows.length < 2) return null;
  const first = new THREE.Vector3().fromArray(path.p, 3 * rows[0]), away = rows.map((i) => new THREE.Vector3().fromArray(path.p, 3 * i).sub(first));
  const longest = (vectors) => vectors.reduce((a, b) => (b.lengthSq() > a.lengthSq() ? b : a)).clone(), across = (v, way) => v.clone().addScaledVector(way, -v.dot(way));
  const reach = longest(away), along = reach.clone().normalize(), side = longest(away.map((v) => across(v, along))), torch = arm.aim().negate();
  const normal = side.length() > 0.02 * reach.length() ? side.cross(along).normalize() : across(torch, along).normalize();
  if (normal.dot(torch) < 0) normal.negate();
  const basis = new THREE.Matrix4().makeBasis(along, new THREE.Vector3().crossVectors(normal, along), normal).setPosition(first), back = basis.clone().invert();
  const box = new THREE.Box3().setFromPoints(away.map((v) => v.add(first).applyMatrix4(back))), size = box.getSize(new THREE.Vector3()), spare = 0.24 * Math.max(size.x, size.y);
  const made = new THREE.Mesh(new THREE.PlaneGeometry(size.x + spare, size.y + spare), space.plane ||= space.paint(new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.55, side: THREE.DoubleSide, depthWrite: false }), "--plane"));
  made.position.copy(box.getCenter(new THREE.Vector3()).setZ(-0.001));
  made.applyMatrix4(basis);
  made.renderOrder = -1;
  space.scene.add(made);
  return made;
}
