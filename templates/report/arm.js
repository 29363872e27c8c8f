"use strict";
// The arm: link[0] Rot(axis[0], q1) .. link[6] from its base to the flange, then the tool, drawn as a torch.

const THICK = [1.3, 1.25, 1, 0.8, 0.6, 0.5, 0.4]; // radii of the links, in shares
const WIRE = 0.012, NOZZLE = 0.09; // lengths of a torch [m]

class Arm {
  /** @param packed what Python says of an arm: {link, axis, tools, tool}; @param space in which it stands. */
  constructor(space, packed) {
    this.toolOf = numbers(packed.tool);
    this.group = new THREE.Group();
    const reach = packed.link.reduce((sum, T) => sum + Math.hypot(T[0][3], T[1][3], T[2][3]), 0), r = 0.035 * reach;
    const skin = space.paint(new THREE.MeshLambertMaterial(), "--arm"), joint = space.paint(new THREE.MeshLambertMaterial(), "--joint");
    let parent = this.group;
    this.joints = packed.link.map((T, j) => {
      const link = new THREE.Group(), axis = packed.axis[j] && new THREE.Vector3(...packed.axis[j]), [x, y, z] = T.map((row) => row[3]);
      // A link goes up, then out.
      for (const part of [...limb([0, 0, 0], [0, 0, z], r * THICK[j], skin), ...limb([0, 0, z], [x, y, z], r * THICK[j], skin)]) parent.add(part);
      if (axis && j < 5) {
        const hub = new THREE.Mesh(new THREE.CylinderGeometry(r * THICK[j] * 1.15, r * THICK[j] * 1.15, r * THICK[j] * 2.7, 24), joint);
        hub.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), axis);
        link.add(hub);
      }
      link.matrixAutoUpdate = false;
      parent.add(link);
      parent = link;
      return { link, axis, T: matrix(T) };
    });
    this.flange = parent;
    this.torches = packed.tools.map((T) => torch(matrix(T), skin, joint));
    for (const one of this.torches) this.flange.add(one);
    this.tools = packed.tools.map(matrix);
  }

  /** Stand at the joint angles of a row, with the tool of another; T: 12 numbers of a pose of the base, or null. */
  pose(q, i, row, T = null) {
    this.joints.forEach(({ link, axis, T: before }, j) => {
      link.matrix.copy(before);
      if (axis) link.matrix.multiply(new THREE.Matrix4().makeRotationAxis(axis, q[6 * i + j]));
    });
    if (T) {
      this.group.matrixAutoUpdate = false;
      this.group.matrix.set(...T, 0, 0, 0, 1);
    }
    this.tool = this.toolOf[row] ?? 0;
    this.torches.forEach((one, k) => { one.visible = k === this.tool; });
    this.group.updateMatrixWorld(true);
  }

  /** Places of the base, the joints, the flange and the TCP: x, y, z, x, y, z, .. */
  places() {
    const tcp = new THREE.Vector3().setFromMatrixPosition(this.tools[this.tool]).applyMatrix4(this.flange.matrixWorld);
    return [this.group.matrixWorld, ...this.joints.map(({ link }) => link.matrixWorld)]
      .flatMap((T) => new THREE.Vector3().setFromMatrixPosition(T).toArray()).concat(tcp.toArray());
  }

  /** Direction of the torch, from the arm to the work. */
  aim() {
    const T = this.flange.matrixWorld.clone().multiply(this.tools[this.tool]);
    return new THREE.Vector3().setFromMatrixColumn(T, 2).normalize();
  }

  /** Show all of it but the torch on another layer than 0. */
  layer(k) {
    this.group.traverse((one) => one.layers.set(k));
    for (const one of this.torches) one.traverse((part) => part.layers.enable(0));
  }
}

function matrix(T) {
  return new THREE.Matrix4().set(...T.slice(0, 3).flat(), 0, 0, 0, 1);
}

function limb(from, to, radius, material) {
  const [a, b] = [new THREE.Vector3(...from), new THREE.Vector3(...to)], length = a.distanceTo(b);
  if (length < 1e-3) return [];
  const made = new THREE.Mesh(new THREE.CapsuleGeometry(radius, length, 8, 24), material);
  made.position.copy(a).add(b).multiplyScalar(0.5);
  made.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), b.sub(a).normalize());
  return [made];
}

/** A torch from the flange to the TCP: it leaves the flange along z and ends along z of the tool. */
function torch(T, skin, dark) {
  const made = new THREE.Group(), tcp = new THREE.Vector3().setFromMatrixPosition(T), length = tcp.length();
  if (length < 1e-3) return made;
  const z = new THREE.Vector3().setFromMatrixColumn(T, 2), back = (s) => tcp.clone().addScaledVector(z, -s);
  const nozzle = Math.min(NOZZLE, 0.35 * length), wire = Math.min(WIRE, 0.2 * nozzle), r = 0.12 * nozzle + 0.005;
  const neck = new THREE.CubicBezierCurve3(new THREE.Vector3(), new THREE.Vector3(0, 0, 0.4 * length), back(nozzle + 0.35 * length), back(nozzle));
  const rod = (from, to, thin, thick, material) => {
    const mesh = new THREE.Mesh(new THREE.CylinderGeometry(thin, thick, from.distanceTo(to), 20), material);
    mesh.position.copy(from).add(to).multiplyScalar(0.5);
    mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), z);
    return mesh;
  };
  made.add(new THREE.Mesh(new THREE.TubeGeometry(neck, 32, r, 14), skin), rod(back(nozzle), back(wire), 0.8 * r, 1.25 * r, dark), rod(back(wire), tcp, 0.0012, 0.0012, dark));
  return made;
}
