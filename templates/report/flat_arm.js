"use strict";
// The arm: link[0] Rot(axis[0], q1) .. link[6] from its base to the flange, then the tool.

class Arm {
  constructor(packed) {
    Object.assign(this, packed);
    this.toolOf = numbers(packed.tool);
  }

  /** Places of the base, the joints, the flange and the tool at the joint angles of a row, with the tool of another. */
  joints(q, i, row) {
    let R = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], p = [0, 0, 0];
    const found = [p];
    const go = (T) => {
      p = p.map((x, r) => x + R[r][0] * T[0][3] + R[r][1] * T[1][3] + R[r][2] * T[2][3]);
      R = R.map((line) => [0, 1, 2].map((c) => line[0] * T[0][c] + line[1] * T[1][c] + line[2] * T[2][c]));
    };
    for (let j = 0; j < 6; j++) {
      go(this.link[j]);
      found.push(p);
      const [x, y, z] = this.axis[j], c = Math.cos(q[6 * i + j]), s = Math.sin(q[6 * i + j]), k = 1 - c;
      go([[c + k * x * x, k * x * y - s * z, k * x * z + s * y, 0], [k * x * y + s * z, c + k * y * y, k * y * z - s * x, 0],
        [k * x * z - s * y, k * y * z + s * x, c + k * z * z, 0]]);
    }
    go(this.link[6]);
    found.push(p);
    const tool = this.tools[this.toolOf[row] ?? 0];
    found.push(p.map((x, r) => x + R[r][0] * tool[0][3] + R[r][1] * tool[1][3] + R[r][2] * tool[2][3]));
    return found;
  }

  draw(space, pen, places) {
    const at = space.projection(), joints = places.map((p) => at(...p));
    const wide = Math.min(Math.max(0.14 * space.scale(), 4), 46);
    const widths = [1.35, 1.2, 1, 0.85, 0.65, 0.55, 0.45, 0.22];
    pen.globalAlpha = 0.9;
    for (let j = 1; j < joints.length; j++) {
      for (const [grow, color] of [[2, css("--line")], [0, css("--arm")]]) {
        pen.strokeStyle = color;
        pen.lineWidth = wide * widths[j - 1] + grow;
        pen.beginPath(); pen.moveTo(...joints[j - 1]); pen.lineTo(...joints[j]); pen.stroke();
      }
    }
    for (let j = 1; j < 7; j++) {
      pen.fillStyle = css("--joint");
      pen.beginPath(); pen.arc(...joints[j], Math.max(0.28 * wide * widths[j], 2), 0, 7); pen.fill();
    }
    pen.globalAlpha = 1;
  }
}
