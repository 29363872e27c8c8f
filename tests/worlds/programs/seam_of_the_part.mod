! A group input chooses the seam: each row of a matrix holds approach, start, middle and end.
MODULE SeamOfThePart
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST seamdata sm1:=[0,0,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0];
  CONST welddata wd1:=[8,0,[0,0,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  ! world: giPart = 1 2 3
  CONST robtarget pHome:=[[300,300,400],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pSeam{3,3}:=[[[[100,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,110,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[330,115,32],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]],[[[110,300,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,330,31],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[320,350,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]],[[[300,500,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[400,510,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[520,520,35],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]]];
  VAR num nPart;
  PROC main()
    MoveJ pHome,v1000,z50,tTorch\WObj:=wPlate;
    FOR i FROM 1 TO 2 DO
      nPart:=giPart;
      MoveJ Offs(pSeam{nPart,1},0,0,80),v800,z20,tTorch\WObj:=wPlate;
      ArcLStart pSeam{nPart,1},v200,sm1,wd1,fine,tTorch\WObj:=wPlate;
      ArcL pSeam{nPart,2},v100,sm1,wd1,z1,tTorch\WObj:=wPlate;
      ArcLEnd pSeam{nPart,3},v100,sm1,wd1,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pSeam{nPart,3},0,0,80),v400,z20,tTorch\WObj:=wPlate;
      MoveJ pHome,v1000,z50,tTorch\WObj:=wPlate;
    ENDFOR
  ENDPROC
ENDMODULE
