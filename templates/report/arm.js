"use strict";
// The arm: link[0] Rot(axis[0], q1) .. link[6] from its base to the flange, then the tool, drawn as a torch.

const THICK = [1.3, 1.25, 1, 0.8, 0.6, 0.5, 0.4]; // radii of the links, in shares
const WIRE = 0.012, NOZZLE = 0.09; // lengths of a torch [m]
const TURN = new THREE.Matrix4();

class Arm {
  /** @param packed what Python says of an arm: {link, axis, tools, tool}; @param space in which it stands. */
  constructor(space, packed) {
    const reach = packed.link.reduce((sum, T) => sum + Math.hypot(T[0][3], T[1][3], T[2][3]), 0);
    const skin = space.paint(new THREE.MeshLambertMaterial(), "--arm"), dark = space.paint(new THREE.MeshLambertMaterial(), "--joint");
    this.toolOf = numbers(packed.tool);
    this.group = this.flange = new THREE.Group();
    this.joints = packed.link.map((rows, j) => {
      const link = new THREE.Group(), T = matrix(rows), axis = packed.axis[j] && new THREE.Vector3(...packed.axis[j]), end = new THREE.Vector3().setFromMatrixPosition(T);
      const knee = new THREE.Vector3(0, 0, end.z), r = 0.035 * reach * THICK[j]; // a link goes up, then out
      this.flange.add(...rod(new THREE.Vector3(), knee, r, skin), ...rod(knee, end, r, skin), link);
      if (axis && j < 5) link.add(...rod(axis.clone().multiplyScalar(-1.35 * r), axis.clone().multiplyScalar(1.35 * r), 1.15 * r, dark, (size, length) => new THREE.CylinderGeometry(size, size, length, 24)));
      link.matrixAutoUpdate = false;
      this.flange = link;
      return { link, axis, T };
    });
    this.tools = packed.tools.map(matrix);
    this.torches = this.tools.map((T) => torch(T, skin, dark));
    this.flange.add(...this.torches);
    space.scene.add(this.group);
  }

  /** Stand at the joint angles of a row, with the tool of another; T: 12 numbers of a pose of the base, or null. */
  pose(q, i, row, T = null) {
    this.joints.forEach(({ link, axis, T: before }, j) => {
      link.matrix.copy(before);
      if (axis) link.matrix.multiply(TURN.makeRotationAxis(axis, q[6 * i + j]));
    });
    if (T) {
      this.group.matrixAutoUpdate = false;
      this.group.matrix.set(...T, 0, 0, 0, 1);
    }
    this.tool = this.toolOf[row] ?? 0;
    this.torches.forEach((one, k) => { one.visible = k === this.tool; });
    this.group.updateMatrixWorld(true);
  }

  /** Pose of the TCP. */
  get tcp() { return this.flange.matrixWorld.clone().multiply(this.tools[this.tool]); }

  /** Places of the base, the joints, the flange and the TCP: x, y, z, x, y, z, .. */
  places() { return [this.group.matrixWorld, ...this.joints.map(({ link }) => link.matrixWorld), this.tcp].flatMap((T) => new THREE.Vector3().setFromMatrixPosition(T).toArray()); }

  /** Direction of the torch, from the arm to the work. */
  aim() { return new THREE.Vector3().setFromMatrixColumn(this.tcp, 2).normalize(); }

  /** Show all of it but the torch on another layer than 0. */
  layer(k) {
    this.group.traverse((one) => one.layers.set(k));
    for (const one of this.torches) one.traverse((part) => part.layers.enable(0));
  }
}

const matrix = (T) => new THREE.Matrix4().set(...T.slice(0, 3).flat(), 0, 0, 0, 1);
const capsule = (size, length) => new THREE.CapsuleGeometry(size, length, 8, 24);

/** A body of revolution from one place to another, none where they are the same. */
function rod(from, to, size, material, shape = capsule) {
  const along = to.clone().sub(from), length = along.length();
  if (length < 1e-3) return [];
  const made = new THREE.Mesh(shape(size, length), material);
  made.position.copy(from).add(to).multiplyScalar(0.5);
  made.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.normalize());
  return [made];
}

/** A torch from the flange to the TCP: it leaves the flange along z and ends along z of the tool. */
function torch(T, skin, dark) {
  const made = new THREE.Group(), tcp = new THREE.Vector3().setFromMatrixPosition(T), length = tcp.length();
  if (length < 1e-3) return made;
  const z = new THREE.Vector3().setFromMatrixColumn(T, 2), back = (s) => tcp.clone().addScaledVector(z, -s);
  const nozzle = Math.min(NOZZLE, 0.35 * length), wire = Math.min(WIRE, 0.2 * nozzle), r = 0.12 * nozzle + 0.005;
  const neck = new THREE.CubicBezierCurve3(new THREE.Vector3(), new THREE.Vector3(0, 0, 0.4 * length), back(nozzle + 0.35 * length), back(nozzle));
  const cone = (thin, thick) => (_, long) => new THREE.CylinderGeometry(thin, thick, long, 20);
  return made.add(new THREE.Mesh(new THREE.TubeGeometry(neck, 32, r, 14), skin), ...rod(back(nozzle), back(wire), r, dark, cone(0.8 * r, 1.25 * r)), ...rod(back(wire), tcp, r, dark, cone(0.0012, 0.0012)));
}
